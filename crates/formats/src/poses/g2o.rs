use super::RigidPose;
use super::pose_rows::{BadKind, BadRow, Stamp};
use super::text::{Rules, pose};

/// A line of a pose graph as g2o, GTSAM and most SLAM programs write it.
pub(super) enum GraphLine<'a> {
    /// A vertex with a pose: its id, and `x y z qx qy qz qw`.
    Pose(&'a str),
    /// A vertex with a pose in the plane, or with angles.
    OtherPose(&'a str),
    /// An edge, a landmark, a parameter.
    Other,
}

impl<'a> GraphLine<'a> {
    /// Classifies a line; `None` for a line of another kind of text.
    pub(super) fn of(line: &'a str) -> Option<Self> {
        let (tag, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match tag {
            "VERTEX_SE3:QUAT" => Some(Self::Pose(rest)),
            "VERTEX_SE2" | "VERTEX2" | "VERTEX3" | "VERTEX_SE3:EULER" | "VERTEX_SE3:EXPMAP" => {
                Some(Self::OtherPose(tag))
            }
            // Of a text, the word alone could be prose.
            "FIX" => rest.trim().parse::<u64>().is_ok().then_some(Self::Other),
            _ => ["VERTEX_", "EDGE_", "EDGE2", "EDGE3", "PARAMS_"]
                .iter()
                .any(|start| tag.starts_with(start))
                .then_some(Self::Other),
        }
    }
}

/// Reads id and pose of a vertex.
pub(super) fn vertex(words: &str) -> Result<(u64, Result<RigidPose, BadRow>), String> {
    let mut words = words.split_whitespace();
    let id = words.next().and_then(|word| word.parse::<u64>().ok());
    let id = id.ok_or_else(|| "VERTEX_SE3:QUAT needs an id, a whole number".to_owned())?;
    let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
    let bad =
        |kind, reason: String| BadRow { reason: format!("vertex {id}: {reason}"), kind, stamp: Stamp::None };
    let pose = match numbers.first_chunk::<7>() {
        Some(numbers) if numbers.iter().any(|number| !number.is_finite()) => {
            Err(bad(BadKind::Lost, "a number is not finite".to_owned()))
        }
        Some(numbers) => pose(*numbers, Rules::Strict).map_err(|reason| bad(BadKind::Odd, reason)),
        None => Err(bad(BadKind::Lost, format!("{} numbers, not x y z qx qy qz qw", numbers.len()))),
    };
    Ok((id, pose))
}
