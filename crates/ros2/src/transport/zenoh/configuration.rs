use crate::args::Args;
use anyhow::anyhow;
use serde_json::{Value, json};
use zenoh::Config;

/// Beyond the largest message that is kept: what is larger than that can be counted, and not only lost.
const ROOM_BYTES: usize = 8 << 20;

/// As a session of `rmw_zenoh_cpp` is configured: a peer that others know from a router, without multicast.
///
/// # Errors
///
/// A file that is no configuration; an endpoint that is none.
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
        ("transport/link/rx/max_message_size", json!(args.queue_bytes().saturating_add(ROOM_BYTES))),
    ];
    let mut config = Config::default();
    for (key, value) in settings {
        config.insert_json5(key, &value.to_string()).map_err(|error| {
            let routers = args.zenoh_router.join(" ");
            anyhow!("--zenoh-router {routers}: {key}: {error}; one looks like tcp/localhost:7447")
        })?;
    }
    Ok(config)
}
