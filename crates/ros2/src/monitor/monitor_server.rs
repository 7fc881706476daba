use super::health_verdict::verdict;
use super::node_metrics::node_metrics;
use super::request::{Response, answer};
use crate::inbox::Inbox;
use crate::listen_address::ListenAddress;
use crate::live_map::LiveMap;
use anyhow::Context as _;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use voxtile_monitoring::CONTENT_TYPE;

/// What the server reports on.
pub struct Monitor {
    pub inbox: Arc<Inbox>,
    pub map: Arc<LiveMap>,
    /// The option `--memory`, in bytes.
    pub memory_limit_bytes: u64,
}

/// HTTP server of `/metrics` and `/health`.
pub struct MonitorServer {
    listener: TcpListener,
    address: SocketAddr,
}

/// Interval between checks for connections and the stop flag.
const POLL_EVERY: Duration = Duration::from_millis(50);
/// Maximum number of connections. Further ones are closed at once.
const MAX_CONNECTIONS: usize = 8;

impl MonitorServer {
    /// Starts to listen; `run` accepts connections.
    ///
    /// # Errors
    ///
    /// The address is not available.
    pub fn bind(address: ListenAddress) -> anyhow::Result<Self> {
        let listener = TcpListener::bind(address.0);
        let listener = listener.with_context(|| format!("--metrics {address}: cannot listen"))?;
        let address = listener.local_addr().and_then(|own| listener.set_nonblocking(true).map(|()| own));
        Ok(Self { address: address.context("--metrics")?, listener })
    }

    /// Serves until stopped.
    pub fn run(self, monitor: Arc<Monitor>, stop: &AtomicBool) {
        log::info!("serving http://{0}/metrics and http://{0}/health", self.address);
        let open = Arc::new(AtomicUsize::new(0));
        while !stop.load(Ordering::Relaxed) {
            let Ok((mut stream, _)) = self.listener.accept() else {
                std::thread::sleep(POLL_EVERY);
                continue;
            };
            if open.load(Ordering::Relaxed) >= MAX_CONNECTIONS {
                continue;
            }
            let (monitor, of_thread) = (monitor.clone(), open.clone());
            open.fetch_add(1, Ordering::Relaxed);
            let work = move || {
                if let Err(error) = answer(&mut stream, |path| monitor.respond(path)) {
                    log::debug!("monitoring: {error}");
                }
                of_thread.fetch_sub(1, Ordering::Relaxed);
            };
            if std::thread::Builder::new().name("monitoring".to_owned()).spawn(work).is_err() {
                open.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }
}

impl Monitor {
    fn respond(&self, path: &str) -> Response {
        match path {
            "/metrics" => {
                Response { content_type: CONTENT_TYPE, ..Response::text("200 OK", node_metrics(self)) }
            }
            "/health" => {
                let verdict = verdict(&self.map.health(), self.inbox.pose_problem(), Instant::now());
                let status = if verdict.is_healthy { "200 OK" } else { "503 Service Unavailable" };
                Response::text(status, format!("{}\n", verdict.text))
            }
            _ => Response::text("404 Not Found", "paths are /metrics and /health\n"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::args::Args;
    use crate::health::Health;
    use clap::Parser;
    use std::io::{Read as _, Write as _};
    use std::net::TcpStream;
    use voxtile::{MapConfig, OutOfCoreTileMapper};

    /// Serves a map for the duration of a test.
    fn serving(test: impl FnOnce(SocketAddr, &Monitor)) {
        let folder = tempfile::tempdir().unwrap();
        let args = Args::parse_from(["voxtile-ros2", "-o", "map"]);
        let config = MapConfig::new(0.1, 1.0).unwrap();
        let mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        let map = Arc::new(LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.0; 3], 0));
        map.note_health(Health { sampled_at: Some(Instant::now()), ..Health::default() });
        let inbox = Arc::new(Inbox::new(&args));
        let monitor = Arc::new(Monitor { inbox, map, memory_limit_bytes: 1 << 30 });
        let server = MonitorServer::bind("0".parse().unwrap()).unwrap();
        let (address, stop) = (server.address, AtomicBool::new(false));
        std::thread::scope(|scope| {
            scope.spawn(|| server.run(monitor.clone(), &stop));
            let tested = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| test(address, &monitor)));
            stop.store(true, Ordering::Relaxed);
            tested.unwrap_or_else(|panic| std::panic::resume_unwind(panic));
        });
    }

    fn exchanged(address: SocketAddr, request: &str) -> String {
        let (mut stream, mut response) = (TcpStream::connect(address).unwrap(), String::new());
        stream.write_all(request.as_bytes()).unwrap();
        stream.read_to_string(&mut response).unwrap();
        response
    }

    #[test]
    fn metrics_and_health_are_served() {
        serving(|address, monitor| {
            let metrics = exchanged(address, "GET /metrics?x=1 HTTP/1.1\r\nHost: a\r\n\r\n");
            assert!(
                metrics.starts_with("HTTP/1.1 200 OK\r\nContent-Type: text/plain; version=0.0.4"),
                "{metrics}"
            );
            assert!(metrics.contains("\nvoxtile_memory_limit_bytes 1073741824\n"), "{metrics}");
            let head = exchanged(address, "HEAD /metrics HTTP/1.1\r\n\r\n");
            assert!(head.starts_with("HTTP/1.1 200 OK\r\n") && head.ends_with("\r\n\r\n"), "{head}");
            let health = || exchanged(address, "GET /health HTTP/1.0\r\n\r\n");
            assert!(health().starts_with("HTTP/1.1 200 OK\r\n") && health().ends_with("\r\n\r\nok\n"));
            monitor.map.note_health(Health { has_flush_failed: true, ..monitor.map.health() });
            let failed = health();
            assert!(
                failed.starts_with("HTTP/1.1 503 ") && failed.contains("the last flush failed"),
                "{failed}"
            );
        });
    }

    #[test]
    fn invalid_requests_are_refused_and_silent_clients_do_not_block_others() {
        serving(|address, _| {
            let silent: Vec<TcpStream> =
                (0..MAX_CONNECTIONS - 1).map(|_| TcpStream::connect(address).unwrap()).collect();
            for (request, status) in [
                ("GET / HTTP/1.1\r\n\r\n", "404"),
                ("GET /metrics/../health HTTP/1.1\r\n\r\n", "404"),
                ("POST /metrics HTTP/1.1\r\nContent-Length: 0\r\n\r\n", "405"),
                ("GET /metrics\r\n\r\n", "400"),
                ("\r\n\r\n", "400"),
                ("\u{0}\u{1}\r\n\r\n", "400"),
            ] {
                let response = exchanged(address, request);
                assert!(response.starts_with(&format!("HTTP/1.1 {status} ")), "{request:?}: {response}");
            }
            drop(silent);
        });
    }
}
