use crate::cloud::Cloud;
use crate::frame_owners::FrameOwners;
use crate::stamp_check::StampCheck;
use std::fmt;
use std::time::Duration;
use voxtile_formats::ros::WhyNot;

/// Explanation for a log why a cloud has no pose, and what to do.
pub struct PoseMiss<'a> {
    pub why: &'a WhyNot,
    pub cloud: &'a Cloud,
    pub map_frame: &'a str,
    pub owners: &'a FrameOwners,
    pub stamps: &'a StampCheck,
    /// Topics of transforms.
    pub sources: &'a str,
    pub max_wait: Duration,
}

/// Maximum number of frames named in a warning.
const MAX_NAMES: usize = 20;
/// A larger difference between the stamps of clouds and transforms is one of clocks.
const MAX_LATE_S: f64 = 10.0;

impl fmt::Display for PoseMiss<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Names are received text: escape control characters.
        let why = self.why.to_string().escape_debug().to_string();
        match self.why {
            WhyNot::AlreadyFixed(_) => write!(
                f,
                "{why}. Publish clouds in the sensor frame with its transforms, or set --frame-id to a frame in which \
                 the sensor moves"
            ),
            WhyNot::After(frame) | WhyNot::Before(frame) => {
                let Some(newest_ns) = self.stamps.newest_ns(frame) else { return f.write_str(&why) };
                let late_s = self.cloud.stamp_ns.saturating_sub(newest_ns) as f64 * 1e-9;
                let age = if late_s < 0.0 { "newer" } else { "older" };
                write!(f, "{why}; the newest is {:.3} s {age} than the cloud", late_s.abs())?;
                if late_s.abs() > MAX_LATE_S {
                    return f.write_str(". Check the clocks of the publishers, and use_sim_time");
                }
                match self.why {
                    WhyNot::After(_) => write!(
                        f,
                        ". Clouds wait {} s for later transforms (--transform-wait)",
                        self.max_wait.as_secs_f64()
                    ),
                    _ => Ok(()),
                }
            }
            WhyNot::Gap(_) => f.write_str(&why.replace("`pose_tolerance`", "--pose-tolerance")),
            _ => {
                let frame = self.cloud.frame.escape_debug();
                write!(f, "no transform from \"{frame}\" to \"{}\": {why}; {}", self.map_frame, self.known())
            }
        }
    }
}

impl PoseMiss<'_> {
    /// Returns the known frames as text.
    fn known(&self) -> String {
        let names = self.owners.names();
        if names.is_empty() {
            return format!("no transform has arrived on {}", self.sources);
        }
        let listed: Vec<String> =
            names.iter().take(MAX_NAMES).map(|name| name.escape_debug().to_string()).collect();
        let more = match names.len().saturating_sub(MAX_NAMES) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        format!("frames known: {}{more}", listed.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Instant;

    fn text(why: WhyNot, frames: usize, newest_ns: i64) -> String {
        let (mut owners, mut stamps) = (FrameOwners::default(), StampCheck::default());
        for number in 0..frames {
            owners.note("odom", &format!("wheel{number:02}\n"), None, false);
        }
        stamps.verdict("base", newest_ns, Instant::now());
        let cloud = Cloud {
            topic: 0,
            stamp_ns: 5_000_000_000,
            frame: "velodyne".to_owned(),
            cdr: Vec::new(),
            points_bytes: 0,
            arrived: Instant::now(),
            periods: None,
            poses: None,
        };
        let (sources, max_wait) = ("/tf and /tf_static", Duration::from_millis(500));
        let (owners, stamps) = (&owners, &stamps);
        let miss = PoseMiss { why: &why, cloud: &cloud, map_frame: "map", owners, stamps, sources, max_wait };
        miss.to_string()
    }

    #[test]
    fn known_frames_are_named() {
        let unknown = || WhyNot::UnknownFrame("velodyne".to_owned());
        let begin = "no transform from \"velodyne\" to \"map\": no transform names the frame velodyne; ";
        assert_eq!(text(unknown(), 0, 0), format!("{begin}no transform has arrived on /tf and /tf_static"));
        assert_eq!(text(unknown(), 2, 0), format!("{begin}frames known: odom, wheel00\\n, wheel01\\n"));
        let many = text(unknown(), 30, 0);
        assert!(many.ends_with("wheel17\\n, wheel18\\n and 11 more"), "{many}");
    }

    #[test]
    fn late_transforms_are_reported_with_their_age() {
        let after = |newest_ns| text(WhyNot::After("base".to_owned()), 1, newest_ns);
        assert_eq!(
            after(4_750_000_000),
            "the stamp is after the last transform of base; the newest is 0.250 s older than the cloud. Clouds wait \
             0.5 s for later transforms (--transform-wait)"
        );
        let clocks = after(-20_000_000_000);
        assert!(clocks.ends_with(
            "25.000 s older than the cloud. Check the clocks of the publishers, and use_sim_time"
        ));
        let before = text(WhyNot::Before("base".to_owned()), 1, 6_000_000_000);
        assert!(before.ends_with("the newest is 1.000 s newer than the cloud"), "{before}");
        let gap = text(WhyNot::Gap("base".to_owned()), 1, 0);
        assert!(gap.ends_with("--pose-tolerance permits larger gaps"), "{gap}");
        let fixed = text(WhyNot::AlreadyFixed("map".to_owned()), 1, 0);
        assert!(fixed.contains("already in the frame map") && fixed.contains("--frame-id"), "{fixed}");
    }
}
