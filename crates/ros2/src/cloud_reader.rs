use crate::args::Args;
use crate::cloud::Cloud;
use crate::cloud_points::CloudPoints;
use crate::cloud_poses::CloudPoses;
use crate::ground_filter::GroundFilter;
use crate::layer_warnings::LayerWarnings;
use crate::point_limits::PointLimits;
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
        })
    }

    /// Returns the points of a cloud. The inbox decoded it before: it is complete, and memory for them is reserved.
    pub fn points(&mut self, cloud: &Cloud, poses: &CloudPoses) -> Option<CloudPoints> {
        let mut message = PointCloud2::decode(Wire::Cdr, &cloud.cdr).ok()?;
        message.read_attributes(attributes_of(&self.layers), std::mem::take(&mut self.values));
        let mut points = CloudPoints::of(&message);
        self.values = message.into_values();
        // With a ground filter the limits are in the base frame, as in octomap_server.
        let CloudPoses { map_from_sensor, base_from_sensor } = poses;
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
