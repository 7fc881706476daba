use super::attachment::GID_BYTES;
use super::type_hash::type_hash;
use crate::names::Names;
use crate::transport::{Qos, TypeName};
use anyhow::anyhow;
use twox_hash::XxHash3_128;

/// Name of the node in keys and tokens of `rmw_zenoh_cpp`.
#[derive(Clone, Debug)]
pub struct GraphName {
    pub domain_id: u16,
    /// Zenoh ID of the session.
    pub zenoh_id: String,
    pub namespace: String,
    pub node_name: String,
}

/// Kind of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Publisher,
    Subscription,
    Service,
}

/// Topic or service with its type.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Absolute name.
    pub name: String,
    /// DDS name of the type.
    pub type_name: String,
    pub type_hash: &'static str,
}

const SPACE: &str = "@ros2_lv";
/// Placeholder for the empty enclave.
const NONE: &str = "%";

impl Channel {
    /// # Errors
    ///
    /// An invalid name in ROS 2, or a type without a known hash.
    pub fn topic(names: &Names, topic: &str, kind: TypeName) -> anyhow::Result<Self> {
        Self::new(names, topic, kind, kind.of_message())
    }

    /// # Errors
    ///
    /// An invalid name in ROS 2, or a type without a known hash.
    pub fn service(names: &Names, service: &str, kind: TypeName) -> anyhow::Result<Self> {
        Self::new(names, service, kind, kind.of_service())
    }

    fn new(names: &Names, name: &str, kind: TypeName, type_name: String) -> anyhow::Result<Self> {
        names.of(name)?;
        let type_hash = type_hash(kind).ok_or_else(|| anyhow!("{name}: no known hash of the type {kind}"))?;
        Ok(Self { name: names.full(name), type_name, type_hash })
    }

    /// Returns the key of messages and queries.
    pub fn key(&self, domain_id: u16) -> String {
        let Self { name, type_name, type_hash } = self;
        format!("{domain_id}/{}/{type_name}/{type_hash}", name.trim_start_matches('/'))
    }
}

impl GraphName {
    /// Returns the token of the node itself, which is entity 0.
    pub fn token(&self) -> String {
        format!("{}/0/NN/{}", self.start(), self.end())
    }

    pub fn token_of(&self, entity: usize, end: End, channel: &Channel, qos: Qos) -> String {
        let end = match end {
            End::Publisher => "MP",
            End::Subscription => "MS",
            End::Service => "SS",
        };
        let Channel { name, type_name, type_hash } = channel;
        let name = mangled(name);
        let (start, node, qos) = (self.start(), self.end(), qos_of(qos));
        format!("{start}/{entity}/{end}/{node}/{name}/{type_name}/{type_hash}/{qos}")
    }

    /// Returns a pattern for the tokens of all subscriptions of a topic.
    pub fn subscriptions(&self, channel: &Channel) -> String {
        let Channel { name, type_name, type_hash } = channel;
        let name = mangled(name);
        format!("{SPACE}/{}/*/*/*/MS/*/*/*/{name}/{type_name}/{type_hash}/*", self.domain_id)
    }

    /// Returns a pattern for the tokens of all publishers.
    pub fn publishers(&self) -> String {
        format!("{SPACE}/{}/*/*/*/MP/*/*/*/*/*/*/*", self.domain_id)
    }

    fn start(&self) -> String {
        format!("{SPACE}/{}/{}/0", self.domain_id, self.zenoh_id)
    }

    fn end(&self) -> String {
        format!("{NONE}/{}/{}", mangled(&self.namespace), self.node_name)
    }
}

/// Returns the Zenoh ID, the name and the DDS type of the topic of a publisher's token.
pub fn publisher_of(token: &str) -> Option<(&str, String, &str)> {
    let parts: Vec<&str> = token.split('/').collect();
    let [_, _, zenoh_id, _, _, "MP", _, _, _, name, type_name, _, _] = *parts.as_slice() else { return None };
    Some((zenoh_id, name.replace('%', "/"), type_name))
}

/// Returns the GID that `rmw_zenoh_cpp` derives from the token of an endpoint.
pub fn gid_of(token: &str) -> [u8; GID_BYTES] {
    XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

fn mangled(name: &str) -> String {
    name.replace('/', "%")
}

/// Encodes reliability, durability and history; default values are empty.
fn qos_of(qos: Qos) -> String {
    let reliability = if qos.is_reliable { "" } else { "2" };
    let durability = if qos.is_latched { "1" } else { "" };
    format!("{reliability}:{durability}:,{}:,:,:,,", qos.depth)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn in_namespace(namespace: &str) -> (GraphName, Names) {
        let names = Names::new(namespace, "mapper", &[]).unwrap();
        let (namespace, node_name) = (names.namespace().to_owned(), "mapper".to_owned());
        (GraphName { domain_id: 3, zenoh_id: "ab12".to_owned(), namespace, node_name }, names)
    }

    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        let (node, names) = in_namespace("/");
        assert_eq!(node.token(), "@ros2_lv/3/ab12/0/0/NN/%/%/mapper");
        let kind = TypeName::new("std_srvs", "Trigger");
        let hash = "RIHS01_eeff2cd6fa5ad9d27cdf4dec64818317839b62f212a91e6b5304b634b2062c5f";
        let save = Channel::service(&names, "~/save", kind).unwrap();
        assert_eq!(save.key(3), format!("3/mapper/save/std_srvs::srv::dds_::Trigger_/{hash}"));
        assert_eq!(
            node.token_of(4, End::Service, &save, Qos::reliable(10)),
            format!(
                "@ros2_lv/3/ab12/0/4/SS/%/%/mapper/%mapper%save/std_srvs::srv::dds_::Trigger_/{hash}/::,10:,:,:,,"
            )
        );
        let (node, names) = in_namespace("/robot/left");
        assert_eq!(node.token(), "@ros2_lv/3/ab12/0/0/NN/%/%robot%left/mapper");
        let cloud = Channel::topic(&names, "cloud_in", TypeName::new("sensor_msgs", "PointCloud2")).unwrap();
        let token = node.token_of(1, End::Subscription, &cloud, Qos::best_effort(5));
        assert!(token.contains(
            "/1/MS/%/%robot%left/mapper/%robot%left%cloud_in/sensor_msgs::msg::dds_::PointCloud2_/"
        ));
        assert!(token.ends_with("/2::,5:,:,:,,"), "{token}");
        let token = node.token_of(2, End::Publisher, &cloud, Qos::latched(1));
        assert!(token.ends_with("/:1:,1:,:,:,,"), "{token}");
        for wrong in [TypeName::new("std_msgs", "Nothing"), TypeName::new("std_srvs", "PointCloud2")] {
            assert!(Channel::topic(&names, "cloud_in", wrong).is_err());
        }
    }

    #[test]
    fn tokens_of_subscriptions_match() {
        let (node, names) = in_namespace("/robot");
        let cloud = Channel::topic(&names, "cloud_in", TypeName::new("sensor_msgs", "PointCloud2")).unwrap();
        let pattern = zenoh::key_expr::KeyExpr::try_from(node.subscriptions(&cloud)).unwrap();
        let token = |end| {
            zenoh::key_expr::KeyExpr::try_from(node.token_of(9, end, &cloud, Qos::reliable(1))).unwrap()
        };
        assert!(pattern.includes(&token(End::Subscription)));
        assert!(!pattern.includes(&token(End::Publisher)));
    }

    #[test]
    fn topics_of_publishers_are_read_from_tokens() {
        let (node, names) = in_namespace("/robot");
        let cloud = Channel::topic(&names, "cloud_in", TypeName::new("sensor_msgs", "PointCloud2")).unwrap();
        let token = |end| node.token_of(9, end, &cloud, Qos::best_effort(5));
        let pattern = zenoh::key_expr::KeyExpr::try_from(node.publishers()).unwrap();
        assert!(pattern.includes(&zenoh::key_expr::KeyExpr::try_from(token(End::Publisher)).unwrap()));
        let found =
            publisher_of(&token(End::Publisher)).map(|(id, topic, kind)| format!("{id} {topic} {kind}"));
        assert_eq!(found.as_deref(), Some("ab12 /robot/cloud_in sensor_msgs::msg::dds_::PointCloud2_"));
        for other in [token(End::Subscription), node.token(), String::new(), "a/".repeat(12)] {
            assert_eq!(publisher_of(&other), None, "{other}");
        }
    }
}
