/// Middleware of the service clients. It determines how requests are identified.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Rmw {
    /// Fast DDS (`rmw_fastrtps`), the default of ROS 2.
    Fastrtps,
    /// Cyclone DDS (`rmw_cyclonedds`).
    Cyclonedds,
}
