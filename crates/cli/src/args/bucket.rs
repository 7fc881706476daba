use super::help;
use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// Parses a number of seconds from 0.1 to 86400 (a day).
pub fn timeout_of(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    match (0.1..=86_400.0).contains(&seconds) {
        true => Ok(Duration::from_secs_f64(seconds)),
        false => Err("must be from 0.1 to 86400 seconds".to_owned()),
    }
}

#[derive(Debug, Args)]
pub struct PushArgs {
    /// Folder of the map; pushes its last flush. Another process may be writing to it
    pub map: PathBuf,
    /// Address of the map: s3://BUCKET/MAP, gs://BUCKET/MAP or az://CONTAINER/MAP. Keys, region and endpoint are read
    /// from the environment (AWS_ACCESS_KEY_ID, AWS_ENDPOINT_URL and so on)
    #[arg(value_name = "URL")]
    pub url: String,
    /// Remove objects in the bucket that the map no longer needs; readers of an earlier push must reopen it
    #[arg(long)]
    pub prune: bool,
    /// Replace the map in the bucket even if another copy of this map was changed and pushed; its changes are lost
    #[arg(long)]
    pub replace: bool,
    /// Upload everything, even objects that already exist; repairs missing or damaged objects. Replaces a manifest that
    /// cannot be read, even one of another map
    #[arg(long)]
    pub resend: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct PullArgs {
    /// Address of the map, as for push, or https://HOST/MAP
    #[arg(value_name = "URL")]
    pub url: String,
    /// Folder of the map; must not exist yet, except with --replace
    pub map: PathBuf,
    /// Replace the map in the folder by the same map in the bucket; changes that were not pushed are lost
    #[arg(long)]
    pub replace: bool,
    #[arg(long, help = help::JSON)]
    pub json: bool,
}
