/// Supported message types.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MessageKind {
    /// `sensor_msgs/PointCloud2`.
    PointCloud2,
    /// `sensor_msgs/PointCloud`.
    PointCloud,
    /// `CustomMsg` of `livox_ros_driver` and `livox_ros_driver2`.
    LivoxCustom,
    /// `sensor_msgs/LaserScan`.
    LaserScan,
    /// `sensor_msgs/Image`; a cloud if its pixels are depths.
    Image,
    /// `sensor_msgs/CompressedImage`; a cloud if its pixels are depths.
    CompressedImage,
    /// `sensor_msgs/CameraInfo`.
    CameraInfo,
    /// `tf2_msgs/TFMessage`, `tf/tfMessage`.
    Tf,
    /// `geometry_msgs/TransformStamped`.
    TransformStamped,
    /// `nav_msgs/Odometry`.
    Odometry,
    /// `geometry_msgs/PoseStamped`.
    PoseStamped,
    /// `geometry_msgs/PoseWithCovarianceStamped`.
    PoseWithCovarianceStamped,
    /// `nav_msgs/Path`.
    Path,
}

impl MessageKind {
    /// Returns the type with this name, in the form of ROS 1 (`sensor_msgs/PointCloud2`), ROS 2
    /// (`sensor_msgs/msg/PointCloud2`) or DDS (`sensor_msgs::msg::dds_::PointCloud2_`).
    pub fn of(type_name: &str) -> Option<Self> {
        let words: Vec<&str> = type_name.split(['/', ':']).filter(|word| !word.is_empty()).collect();
        let (package, name) = (*words.first()?, words.last()?.trim_end_matches('_'));
        Some(match (package, name) {
            ("sensor_msgs", "PointCloud2") => Self::PointCloud2,
            ("sensor_msgs", "PointCloud") => Self::PointCloud,
            (package, "CustomMsg") if package.starts_with("livox_") => Self::LivoxCustom,
            ("sensor_msgs", "LaserScan") => Self::LaserScan,
            ("sensor_msgs", "Image") => Self::Image,
            ("sensor_msgs", "CompressedImage") => Self::CompressedImage,
            ("sensor_msgs", "CameraInfo") => Self::CameraInfo,
            ("tf2_msgs", "TFMessage") | ("tf", "tfMessage") => Self::Tf,
            ("geometry_msgs", "TransformStamped") => Self::TransformStamped,
            ("nav_msgs", "Odometry") => Self::Odometry,
            ("geometry_msgs", "PoseStamped") => Self::PoseStamped,
            ("geometry_msgs", "PoseWithCovarianceStamped") => Self::PoseWithCovarianceStamped,
            ("nav_msgs", "Path") => Self::Path,
            _ => return None,
        })
    }

    /// Returns whether messages are clouds.
    pub fn is_cloud(self) -> bool {
        matches!(self, Self::PointCloud2 | Self::PointCloud | Self::LivoxCustom | Self::LaserScan)
            || self.is_image()
    }

    /// Returns whether messages are images, which may contain depths.
    pub fn is_image(self) -> bool {
        matches!(self, Self::Image | Self::CompressedImage)
    }

    /// Returns whether messages contain poses over time.
    pub fn is_pose(self) -> bool {
        matches!(
            self,
            Self::TransformStamped
                | Self::Odometry
                | Self::PoseStamped
                | Self::PoseWithCovarianceStamped
                | Self::Path
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ros_1_ros_2_and_dds_names_are_equivalent() {
        for name in
            ["sensor_msgs/PointCloud2", "sensor_msgs/msg/PointCloud2", "sensor_msgs::msg::dds_::PointCloud2_"]
        {
            assert_eq!(MessageKind::of(name), Some(MessageKind::PointCloud2), "{name}");
        }
        assert_eq!(MessageKind::of("tf/tfMessage"), Some(MessageKind::Tf));
        assert_eq!(MessageKind::of("std_msgs/PointCloud2"), None);
        assert_eq!(MessageKind::of(""), None);
    }
}
