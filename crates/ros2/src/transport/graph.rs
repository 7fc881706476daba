use super::dds::DdsGraph;
#[cfg(feature = "zenoh")]
use super::zenoh::ZenohGraph;

/// Topics that other nodes publish.
pub enum Graph {
    Dds(DdsGraph),
    #[cfg(feature = "zenoh")]
    Zenoh(ZenohGraph),
}

/// Topic of a publisher.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Published {
    /// Absolute name.
    pub topic: String,
    /// Type in the form of ROS, such as `sensor_msgs/msg/PointCloud2`.
    pub kind: String,
}

impl Graph {
    /// Returns the topics of all known publishers in other programs. Takes up to a second with Zenoh.
    pub fn published(&self) -> Vec<Published> {
        match self {
            Self::Dds(graph) => graph.published(),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(graph) => graph.published(),
        }
    }
}

impl Published {
    /// Converts the DDS name of a type, such as `sensor_msgs::msg::dds_::PointCloud2_`. Returns `None` for other types.
    pub fn of(topic: &str, dds_type: &str) -> Option<Self> {
        let (package, name) = dds_type.split_once("::msg::dds_::")?;
        let name = name.strip_suffix('_')?;
        Some(Self { topic: topic.to_owned(), kind: format!("{package}/msg/{name}") })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dds_types_are_converted() {
        let of = |kind| Published::of("/points", kind).map(|published| published.kind);
        assert_eq!(
            of("sensor_msgs::msg::dds_::PointCloud2_").as_deref(),
            Some("sensor_msgs/msg/PointCloud2")
        );
        for other in ["", "PointCloud2", "a::srv::dds_::B_", "a::msg::dds_::B"] {
            assert_eq!(of(other), None, "{other}");
        }
    }
}
