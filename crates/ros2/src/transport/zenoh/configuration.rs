use crate::args::Args;
use anyhow::anyhow;
use serde_json::{Value, json};
use zenoh::Config;

/// Margin above the largest accepted message. Messages within it are received and counted as too large; Zenoh drops
/// larger ones.
const EXTRA_BYTES: usize = 8 << 20;

/// Returns the configuration of a session in `rmw_zenoh_cpp`: a peer that is discovered through a router, without
/// multicast.
///
/// # Errors
///
/// An invalid configuration file or endpoint.
pub fn configuration(args: &Args) -> anyhow::Result<Config> {
    if let Some(path) = &args.zenoh_config {
        return Config::from_file(path)
            .map_err(|error| anyhow!("--zenoh-config {}: {error}", path.display()));
    }
    let listen = if args.network { "tcp/[::]:0" } else { "tcp/127.0.0.1:0" };
    let settings: [(&str, Value); 6] = [
        ("mode", json!("peer")),
        ("connect/endpoints", json!(args.zenoh_router)),
        ("listen/endpoints", json!([listen])),
        ("scouting/multicast/enabled", json!(false)),
        ("timestamping/enabled", json!(true)),
        ("transport/link/rx/max_message_size", json!(args.queue_bytes().saturating_add(EXTRA_BYTES))),
    ];
    let mut config = Config::default();
    for (key, value) in settings {
        config.insert_json5(key, &value.to_string()).map_err(|error| {
            let routers = args.zenoh_router.join(" ");
            anyhow!(
                "--zenoh-router {routers}: {key}: {error}; expected an endpoint such as tcp/localhost:7447"
            )
        })?;
    }
    Ok(config)
}
