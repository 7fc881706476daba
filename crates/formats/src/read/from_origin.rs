use super::cloud::{CloudHead, CloudSource};
use super::one::Visit;
use crate::poses::RigidPose;
use voxtile::{Error, Result};

/// Wraps a source of registered clouds to give their points relative to a known sensor position.
pub struct FromOrigin {
    source: Box<dyn CloudSource>,
    origin_m: [f64; 3],
    /// Whether the current cloud has its own pose, which is kept.
    is_posed: bool,
}

impl FromOrigin {
    /// Wraps a source. `origin_m` is the sensor position in the frame of the points, in metres.
    ///
    /// # Errors
    ///
    /// The origin is not finite.
    pub fn new(source: Box<dyn CloudSource>, origin_m: [f64; 3]) -> Result<Self> {
        if !origin_m.iter().all(|axis| axis.is_finite()) {
            return Err(Error::argument("sensor origin", "must be three finite numbers in metres"));
        }
        Ok(Self { source, origin_m, is_posed: false })
    }
}

impl CloudSource for FromOrigin {
    fn format(&self) -> &str {
        self.source.format()
    }

    fn len_hint(&self) -> Option<u64> {
        self.source.len_hint()
    }

    fn ends(&self) -> Option<[String; 2]> {
        self.source.ends()
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        let mut head = self.source.next_cloud()?;
        if let Some(head) = &mut head {
            self.is_posed = head.world_from_sensor.is_some();
            if !self.is_posed {
                head.world_from_sensor = Some(RigidPose { position_m: self.origin_m, ..RigidPose::IDENTITY });
            }
        }
        Ok(head)
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        if self.is_posed {
            return self.source.read_points(visit);
        }
        let [x, y, z] = self.origin_m;
        self.source.read_points(&mut |mut point| {
            let [px, py, pz] = point.position_m;
            point.position_m = [px - x, py - y, pz - z];
            visit(point)
        })
    }

    fn remarks(&self) -> Vec<String> {
        self.source.remarks()
    }

    fn crs(&self) -> Option<&str> {
        self.source.crs()
    }
}
