use super::answer_memory::AnswerMemory;
use super::client_stream::ClientStream;
use super::comparison::ServedComparison;
use super::connections::{Client, Connection, Connections};
use super::response::{Answer, Body, Keep, empty};
use super::route::{Route, version_in};
use super::served_map::{Makes, ServedMap};
use super::token::Token;
use super::view_metrics::{Responses, metrics};
use super::work::Work;
use super::{answers, page};
use bytes::Bytes;
use http_body_util::BodyExt;
use http_body_util::channel::Channel;
use hyper::body::Incoming;
use hyper::header::{
    ACCEPT_ENCODING, ALLOW, CACHE_CONTROL, CONNECTION, CONTENT_TYPE, HOST, HeaderValue, LOCATION,
};
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use std::convert::Infallible;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::watch;
use tokio_io_timeout::TimeoutStream;
use voxtile::scan::Stop;

/// A connection without a request for this time is closed, so that silent clients cannot hold connections.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(5);
/// A connection that reads nothing of its response for this time is closed.
const WRITE_TIMEOUT: Duration = Duration::from_secs(30);
/// Maximum size of the buffers of a connection: for the request, and for the response in addition to its content.
const BUFFER_BYTES: usize = 32 << 10;
/// Interval of keep-alive messages in event streams.
const KEEP_ALIVE_INTERVAL: Duration = Duration::from_secs(15);

/// HTTP server that runs until a signal.
pub struct Server {
    maps: Vec<Arc<ServedMap>>,
    comparison: Option<Arc<ServedComparison>>,
    token: Token,
    address: SocketAddr,
    changed: watch::Receiver<u64>,
    /// Identifies this server to the page, because generations restart with each server.
    id: String,
    /// Limits concurrent work, as each response may hold a tile.
    work: Work,
    /// Builds levels of snapshots, one at a time on all cores. This takes seconds, so it must not block other work.
    making: Work,
    /// Reads kept scans or many tiles, for one response at a time. This takes seconds, too.
    reading: Work,
    /// Computes distances on all cores, for one response at a time.
    measuring: Work,
    memory: AnswerMemory,
    connections: Connections,
    responses: Responses,
}

impl Server {
    pub fn new(
        maps: Vec<Arc<ServedMap>>,
        comparison: Option<Arc<ServedComparison>>,
        token: Token,
        address: SocketAddr,
        changed: watch::Receiver<u64>,
    ) -> Self {
        let threads = std::thread::available_parallelism().map_or(2, usize::from);
        let id = format!("{:016x}", RandomState::new().build_hasher().finish());
        let [work, making, reading, measuring] = [threads, 1, 1, 1].map(Work::new);
        let memory = AnswerMemory::default();
        let (connections, responses) = (Connections::new(), Responses::default());
        Self {
            id,
            maps,
            comparison,
            token,
            address,
            changed,
            work,
            making,
            reading,
            measuring,
            memory,
            connections,
            responses,
        }
    }

    pub fn run(self, listener: TcpListener) -> anyhow::Result<()> {
        listener.set_nonblocking(true)?;
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let accept = Arc::new(self).accept(listener);
            tokio::select! {
                () = accept => {}
                stopped = stop_signal() => stopped?,
            }
            anyhow::Ok(())
        })?;
        // Responses in progress are not needed any more.
        runtime.shutdown_background();
        Ok(())
    }

    async fn accept(self: Arc<Self>, listener: tokio::net::TcpListener) {
        loop {
            let (stream, address) = match listener.accept().await {
                Ok(accepted) => accepted,
                // Too many open files, or the client has disconnected.
                Err(error) => {
                    log::warn!("cannot accept a connection: {error}");
                    tokio::time::sleep(Duration::from_millis(50)).await;
                    continue;
                }
            };
            let connection = Arc::new(self.connections.enter(Client::of(address.ip())));
            let mut stream = TimeoutStream::new(stream);
            stream.set_write_timeout(Some(WRITE_TIMEOUT));
            let stream = ClientStream::new(Box::pin(stream), connection.clone());
            let server = self.clone();
            tokio::spawn(async move {
                let answering = connection.clone();
                let service = service_fn(move |request| {
                    let (server, connection) = (server.clone(), answering.clone());
                    async move { Ok::<_, Infallible>(server.answer(request, &connection).await) }
                });
                let served = http1::Builder::new()
                    .timer(TokioTimer::new())
                    .header_read_timeout(REQUEST_TIMEOUT)
                    .max_buf_size(BUFFER_BYTES)
                    .serve_connection(TokioIo::new(stream), service);
                tokio::select! {
                    served = served => if let Err(error) = served {
                        log::debug!("connection closed: {error}");
                    },
                    () = connection.ended() => {}
                }
            });
        }
    }

    async fn answer(self: Arc<Self>, request: Request<Incoming>, connection: &Connection) -> Response<Body> {
        connection.set_busy(true);
        let response = self.clone().response(request, connection).await;
        self.responses.count(response.status());
        connection.set_busy(false);
        connection.note_progress();
        response
    }

    async fn response(
        self: Arc<Self>,
        request: Request<Incoming>,
        connection: &Connection,
    ) -> Response<Body> {
        let is_head = request.method() == Method::HEAD;
        let takes_gzip = takes_gzip(&request);
        let mut response = match self.clone().route(&request) {
            Ok(Route::Slash) => {
                let mut response = empty(StatusCode::PERMANENT_REDIRECT);
                if let Ok(to) = HeaderValue::from_str(&format!("/{}/", self.token.as_str())) {
                    response.headers_mut().insert(LOCATION, to);
                }
                response
            }
            Ok(Route::Events) if !is_head => {
                connection.begin_events();
                self.events()
            }
            Ok(route) => {
                let answer = self.compute(route, request.uri().query()).await;
                answer.into_response(takes_gzip, &self.memory, connection)
            }
            Err(answer) => {
                let is_wrong_method = answer.status == StatusCode::METHOD_NOT_ALLOWED;
                let mut response = answer.into_response(takes_gzip, &self.memory, connection);
                // Unauthorised clients get no persistent connection.
                response.headers_mut().insert(CONNECTION, HeaderValue::from_static("close"));
                if is_wrong_method {
                    response.headers_mut().insert(ALLOW, HeaderValue::from_static("GET, HEAD"));
                }
                response
            }
        };
        if is_head {
            *response.body_mut() = http_body_util::Empty::new().boxed_unsync();
        }
        response
    }

    fn route(&self, request: &Request<Incoming>) -> Result<Route, Answer> {
        if ![Method::GET, Method::HEAD].contains(request.method()) {
            return Err(Answer::error(StatusCode::METHOD_NOT_ALLOWED, "only GET and HEAD are supported"));
        }
        if !self.has_own_host(request) {
            return Err(Answer::error(StatusCode::FORBIDDEN, "wrong host name"));
        }
        Route::of(request.uri().path(), request.uri().query(), &self.token)
            .ok_or_else(|| Answer::error(StatusCode::NOT_FOUND, "not found; check that the URL is complete"))
    }

    /// Checks the Host header on a loopback address: prevents DNS rebinding by pages of other sites.
    fn has_own_host(&self, request: &Request<Incoming>) -> bool {
        if !self.address.ip().is_loopback() {
            return true;
        }
        let host = request.headers().get(HOST).and_then(|host| host.to_str().ok()).unwrap_or_default();
        let name = match host.rsplit_once(':') {
            Some((name, port)) if !port.contains(']') => name,
            _ => host,
        };
        let is_address = name.trim_start_matches('[').trim_end_matches(']').parse::<std::net::IpAddr>();
        name == "localhost" || is_address.is_ok_and(|ip| ip.is_loopback())
    }

    async fn compute(self: &Arc<Self>, route: Route, question: Option<&str>) -> Answer {
        if let Route::Page(name) = route {
            return match page::file(name) {
                Some(file) => Answer {
                    status: StatusCode::OK,
                    kind: file.kind,
                    gzip: file.gzip.clone(),
                    shared: Some(file.plain.clone()),
                    keep: Keep::No,
                },
                None => Answer::error(StatusCode::NOT_FOUND, "no such file"),
            };
        }
        if route == Route::Metrics {
            let server = self.clone();
            let metrics =
                move || metrics(&server.maps, &server.responses, &server.connections, &server.memory);
            let text = self.work.run(metrics).await;
            return text.map_or_else(ending, |text| Answer::metrics(&text));
        }
        let Route::Of(id, thing) = route else {
            let server = self.clone();
            let maps = move || answers::maps(&server.maps, server.comparison.as_deref());
            return self.work.run(maps).await.unwrap_or_else(ending);
        };
        let version = question.and_then(version_in);
        let abandoned = StopOnDrop(Stop::default());
        let ask = |makes| {
            let (server, id, thing, stop) = (self.clone(), id.clone(), thing.clone(), abandoned.0.clone());
            let comparison = self.comparison.clone();
            move || answers::of_map(&server.maps, comparison.as_deref(), &id, &thing, version, makes, &stop)
        };
        let first = match &thing {
            thing if thing.reads_much() => &self.reading,
            thing if thing.takes_distances() => &self.measuring,
            _ => &self.work,
        };
        let answer = match first.run(ask(Makes::Nothing)).await {
            // Build the levels first.
            Some(None) => self.making.run(ask(Makes::Levels)).await,
            answer => answer,
        };
        answer.flatten().unwrap_or_else(ending)
    }

    /// Returns the event stream of changes.
    fn events(&self) -> Response<Body> {
        let (mut sender, body) = Channel::<Bytes, Infallible>::new(4);
        let (id, maps, mut changed) = (self.id.clone(), self.maps.clone(), self.changed.clone());
        tokio::spawn(async move {
            let mut sent = vec![0; maps.len()];
            loop {
                let mut text = String::new();
                changed.mark_unchanged();
                for (number, map) in maps.iter().enumerate() {
                    let generation = map.now().generation;
                    if std::mem::replace(&mut sent[number], generation) != generation {
                        let map = number.to_string();
                        let data = serde_json::json!({ "map": map, "generation": generation, "server": id });
                        text += &format!("event: changed\ndata: {data}\n\n");
                    }
                }
                if text.is_empty() {
                    text = "event: alive\ndata: {}\n\n".to_owned();
                }
                if sender.send_data(text.into()).await.is_err() {
                    return;
                }
                // The sender is gone: the server stops.
                if let Ok(Err(_)) = tokio::time::timeout(KEEP_ALIVE_INTERVAL, changed.changed()).await {
                    return;
                }
            }
        });
        let mut response = empty(StatusCode::OK);
        response.headers_mut().insert(CONTENT_TYPE, HeaderValue::from_static("text/event-stream"));
        response.headers_mut().insert(CACHE_CONTROL, HeaderValue::from_static("no-store"));
        *response.body_mut() = body.boxed_unsync();
        response
    }
}

/// Stops the work for a response when its client has disconnected: the response is dropped then.
struct StopOnDrop(Stop);

impl Drop for StopOnDrop {
    fn drop(&mut self) {
        self.0.set();
    }
}

fn ending() -> Answer {
    Answer::error(StatusCode::SERVICE_UNAVAILABLE, "the server is stopping")
}

fn takes_gzip(request: &Request<Incoming>) -> bool {
    let accepted = request.headers().get(ACCEPT_ENCODING).and_then(|accepted| accepted.to_str().ok());
    accepted.is_some_and(|accepted| {
        accepted.split(',').any(|coding| {
            let mut parts = coding.split(';').map(str::trim);
            let is_gzip = parts.next().is_some_and(|name| name.eq_ignore_ascii_case("gzip") || name == "*");
            is_gzip && !parts.any(|part| part.replace(' ', "") == "q=0")
        })
    })
}

#[cfg(unix)]
async fn stop_signal() -> std::io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let (mut interrupt, mut terminate) = (signal(SignalKind::interrupt())?, signal(SignalKind::terminate())?);
    tokio::select! {
        _ = interrupt.recv() => {}
        _ = terminate.recv() => {}
    }
    Ok(())
}

#[cfg(not(unix))]
async fn stop_signal() -> std::io::Result<()> {
    tokio::signal::ctrl_c().await
}

#[cfg(test)]
mod tests {
    use super::super::route::{At, MapId, Thing};
    use super::*;
    use std::path::Path;
    use tokio::time::timeout;
    use voxtile::mapper::OutOfCoreTileMapper;
    use voxtile::store::SnapshotName;
    use voxtile::{MapConfig, Mapper, Scan};

    /// Returns a server of a map with a snapshot.
    fn server(folder: &Path, snapshot: &SnapshotName) -> Arc<Server> {
        let path = folder.join("map");
        let mut map = OutOfCoreTileMapper::create(&path, MapConfig::new(0.1, 1.0).unwrap()).unwrap();
        map.insert_scan(&Scan { points: vec![[2.0, 0.0, 0.0]], ..Scan::default() }).unwrap();
        map.snapshot(snapshot).unwrap();
        drop(map);
        let maps = vec![Arc::new(ServedMap::open(&path, false, Arc::new(|_, _| ())).unwrap())];
        let (_changes, changed) = watch::channel(0);
        let address = SocketAddr::from(([127, 0, 0, 1], 0));
        Arc::new(Server::new(maps, None, Token::new("sesame_42").unwrap(), address, changed))
    }

    #[test]
    fn reading_scans_does_not_block_other_requests() {
        let (folder, name) = (tempfile::tempdir().unwrap(), SnapshotName::new("monday").unwrap());
        let server = server(folder.path(), &name);
        let of_map = |thing| Route::Of(MapId { number: 0, at: At::Now, since: None }, thing);
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let (end, may_end) = std::sync::mpsc::channel::<()>();
            let reading = server.clone();
            tokio::spawn(async move { reading.reading.run(move || may_end.recv()).await });
            tokio::time::sleep(Duration::from_millis(50)).await;
            let waiting = {
                let (server, route) = (server.clone(), of_map(Thing::Moving));
                tokio::spawn(async move { server.compute(route, None).await })
            };
            let answer = timeout(Duration::from_secs(60), server.compute(of_map(Thing::Trajectory), None));
            assert_eq!(answer.await.expect("no answer").status, StatusCode::OK);
            assert!(!waiting.is_finished());
            end.send(()).unwrap();
            assert_eq!(waiting.await.unwrap().status, StatusCode::OK);
        });
    }

    #[test]
    fn building_levels_of_a_snapshot_does_not_block_other_requests() {
        let (folder, name) = (tempfile::tempdir().unwrap(), SnapshotName::new("monday").unwrap());
        let server = server(folder.path(), &name);
        let of_snapshot =
            |thing| Route::Of(MapId { number: 0, at: At::Snapshot(name.clone()), since: None }, thing);
        let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build().unwrap();
        runtime.block_on(async {
            let (end, may_end) = std::sync::mpsc::channel::<()>();
            let making = server.clone();
            tokio::spawn(async move { making.making.run(move || may_end.recv()).await });
            tokio::time::sleep(Duration::from_millis(50)).await;
            let waiting: Vec<_> = (0..100)
                .map(|_| {
                    let (server, route) = (server.clone(), of_snapshot(Thing::Tileset));
                    tokio::spawn(async move { server.compute(route, None).await })
                })
                .collect();
            tokio::time::sleep(Duration::from_millis(50)).await;
            let at = [2.0, 0.0, 0.0];
            for thing in [Thing::Trajectory, Thing::Moving, Thing::Query(at), Thing::Raycast([0.0; 3], at)] {
                let answer = timeout(Duration::from_secs(60), server.compute(of_snapshot(thing), None)).await;
                assert_eq!(answer.expect("no answer").status, StatusCode::OK);
            }
            let answer = timeout(Duration::from_secs(60), server.compute(Route::Maps, None)).await;
            assert_eq!(answer.expect("no answer").status, StatusCode::OK);
            assert!(waiting.iter().all(|waiting| !waiting.is_finished()));
            end.send(()).unwrap();
            for waiting in waiting {
                assert_eq!(waiting.await.unwrap().status, StatusCode::OK);
            }
        });
    }
}
