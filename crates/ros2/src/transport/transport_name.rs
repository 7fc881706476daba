#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TransportName {
    /// DDS, compatible with Fast DDS and Cyclone DDS.
    Dds,
    /// Zenoh, compatible with `rmw_zenoh_cpp` (Jazzy and later).
    Zenoh,
}
