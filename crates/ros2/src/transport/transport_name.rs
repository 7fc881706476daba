/// What carries messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TransportName {
    /// DDS, as Fast DDS and Cyclone DDS speak it.
    Dds,
    /// Zenoh, as `rmw_zenoh_cpp` speaks it (Jazzy and later).
    Zenoh,
}
