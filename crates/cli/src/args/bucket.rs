use clap::Args;
use std::path::PathBuf;
use std::time::Duration;

/// A number of seconds from 0.1 to a day.
pub fn timeout_of(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds".to_owned())?;
    match (0.1..=86_400.0).contains(&seconds) {
        true => Ok(Duration::from_secs_f64(seconds)),
        false => Err("must be from 0.1 to 86400 seconds".to_owned()),
    }
}

#[derive(Debug, Args)]
pub struct PushArgs {
    /// Folder of the map; a writer may be at work on it, and its last flush is pushed
    pub map: PathBuf,
    /// Where the map goes: s3://BUCKET/MAP, gs://BUCKET/MAP or az://CONTAINER/MAP; keys, region and endpoint come from
    /// the environment (AWS_ACCESS_KEY_ID, AWS_ENDPOINT_URL and so on)
    #[arg(value_name = "URL")]
    pub url: String,
    /// Remove the objects there that the map does not need any more; who reads an earlier push has to open it anew
    #[arg(long)]
    pub prune: bool,
    /// Replace a state there that a copy of this map went to on a way of its own; what only that state has is lost
    #[arg(long)]
    pub replace: bool,
    /// Send everything, also what should be there already: mends a map there of which objects were lost or damaged; a
    /// manifest there that cannot be read is replaced, whatever map it was of
    #[arg(long)]
    pub resend: bool,
    /// Print JSON; sizes in bytes
    #[arg(long)]
    pub json: bool,
}

#[derive(Debug, Args)]
pub struct PullArgs {
    /// Where the map is: as for push, or https://HOST/MAP
    #[arg(value_name = "URL")]
    pub url: String,
    /// Folder of the map; it does not exist yet, or --replace is given
    pub map: PathBuf,
    /// Replace the state of the same map that is in the folder; what it has and the bucket lacks is lost
    #[arg(long)]
    pub replace: bool,
    /// Print JSON; sizes in bytes
    #[arg(long)]
    pub json: bool,
}
