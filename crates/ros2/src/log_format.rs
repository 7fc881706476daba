/// Format of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Level, module and message.
    Text,
    /// A JSON object per line: time (UTC), level, target, message.
    Json,
}
