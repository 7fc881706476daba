use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_points::CloudPoints;
use crate::cloud_poses::CloudPoses;
use crate::ground_filter::GroundFilter;
use crate::layer_warnings::LayerWarnings;
use crate::point_limits::PointLimits;
use crate::repeated::{Repeated, counted};
use std::collections::BTreeSet;
use std::time::Instant;
use voxtile::Layers;
use voxtile::scan::{AttributeSet, ScanPoints};
use voxtile_formats::read::AttributeValues;
use voxtile_formats::ros::Wire;
use voxtile_formats::ros::messages::PointCloud2;

/// Decodes clouds for the map: with the attributes of its layers, limits and ground filter.
#[derive(Debug)]
pub struct CloudReader {
    limits: PointLimits,
    ground: Option<GroundFilter>,
    layers: Layers,
    values: AttributeValues,
    warnings: LayerWarnings,
    is_deskewed: bool,
    /// Warning about clouds that are deskewed in part.
    partial: Repeated,
    /// Topics with clouds without point times.
    without_times: BTreeSet<usize>,
}

/// Returns the attributes of points that layers take.
pub fn attributes_of(layers: &Layers) -> AttributeSet {
    AttributeSet { colours: layers.colour, classes: layers.class, ..AttributeSet::NONE }
}

impl CloudReader {
    /// # Errors
    ///
    /// Invalid limits or an invalid ground filter.
    pub fn new(args: &Args, layers: Layers) -> anyhow::Result<Self> {
        Ok(Self {
            limits: args.point_limits()?,
            ground: args.ground_filter()?,
            layers,
            values: AttributeValues::default(),
            warnings: LayerWarnings::default(),
            is_deskewed: args.deskew,
            partial: Repeated::default(),
            without_times: BTreeSet::new(),
        })
    }

    /// Returns the points of a cloud. The inbox decoded it before: it is complete, and memory for them is reserved.
    pub fn points(&mut self, cloud: &Cloud, poses: &CloudPoses) -> Option<CloudPoints> {
        let mut message = PointCloud2::decode(Wire::Cdr, &cloud.cdr).ok()?;
        message.read_attributes(attributes_of(&self.layers), std::mem::take(&mut self.values));
        let CloudPoses { map_from_sensor, base_from_sensor, motion } = poses;
        if motion.as_ref().is_some_and(|motion| motion.is_partial)
            && let Some(count) = self.partial.note(1, Instant::now())
        {
            let clouds = counted(count, "cloud");
            log::warn!(
                "{clouds} deskewed in part: transforms at the times of the last points did not arrive"
            );
        }
        if self.is_deskewed && cloud.periods.is_none() && self.without_times.insert(cloud.topic) {
            log::warn!(
                "--deskew has no effect: a cloud of {} has no field of point times",
                cloud.frame.escape_debug()
            );
        }
        let sweep = motion.as_ref().map(|motion| motion.sweep.clone());
        let mut points = CloudPoints::of(&message, sweep);
        self.values = message.into_values();
        // With a ground filter the limits are in the base frame, as in octomap_server.
        points.limit(&self.limits, base_from_sensor.as_ref().unwrap_or(map_from_sensor));
        if let (Some(filter), Some(base_from_sensor)) = (&self.ground, base_from_sensor) {
            points.mark_ground(filter, base_from_sensor);
        }
        Some(points)
    }

    /// Warns of layers that a mapped cloud does not fill.
    pub fn check_layers(&mut self, scan: &dyn ScanPoints) {
        let warnings = self.warnings.of(&self.layers, scan);
        let remarks = self.warnings.new_remarks(self.values.remarks());
        warnings.into_iter().chain(remarks).for_each(|text| log::warn!("{text}"));
    }
}
