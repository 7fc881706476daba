use parking_lot::Mutex;
use std::collections::{BTreeMap, HashMap};
use std::net::{IpAddr, Ipv6Addr};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// Maximum number of connections of all clients.
const MAX_CONNECTIONS: usize = 512;
/// Maximum number of connections of one client. A further one closes the connection that has had no progress for
/// longest.
const MAX_OF_CLIENT: usize = 256;
/// Maximum number of event streams of one client, which may be a proxy. A further one closes the oldest; browsers
/// reconnect.
const MAX_EVENTS_OF_CLIENT: usize = MAX_OF_CLIENT / 2;
/// A connection is idle after this time without progress; before, its request may be in transit.
const IDLE: Duration = Duration::from_secs(1);
/// If memory for responses is short, connections whose response made no progress for this time are closed.
const STALLED: Duration = Duration::from_secs(5);

/// Identity of a client: an IPv4 address, a local IPv6 address, or the 64-bit network of a global IPv6 address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Client(IpAddr);

impl Client {
    pub fn of(address: IpAddr) -> Self {
        Self(match address.to_canonical() {
            IpAddr::V6(address)
                if !(address.is_loopback()
                    || address.is_unicast_link_local()
                    || address.is_unique_local()) =>
            {
                Ipv6Addr::from_bits(address.to_bits() >> 64 << 64).into()
            }
            other => other,
        })
    }
}

/// Open connections, limited so that one client cannot block others.
#[derive(Clone)]
pub struct Connections {
    open: Arc<Mutex<Open>>,
    since: Instant,
}

#[derive(Default)]
struct Open {
    /// By connection number, ascending.
    of: HashMap<Client, BTreeMap<u64, Arc<State>>>,
    count: usize,
    last: u64,
    last_stream: u64,
}

#[derive(Default)]
struct State {
    /// Time of the last read or write in milliseconds.
    progress_ms: AtomicU64,
    /// Whether a response is being computed.
    is_busy: AtomicBool,
    /// Sequence number of its event stream, from 1; 0 for other connections.
    stream: AtomicU64,
    /// Bytes of its responses that the client has not read yet.
    held_bytes: AtomicUsize,
    end: Notify,
}

/// Slot of one connection, released on drop.
pub struct Connection {
    connections: Connections,
    client: Client,
    number: u64,
    state: Arc<State>,
}

impl Connections {
    pub fn new() -> Self {
        Self { open: Arc::default(), since: Instant::now() }
    }

    /// Registers a connection. If there are too many, another one is closed: one of the same client, or else one of the
    /// client with most connections.
    pub fn enter(&self, client: Client) -> Connection {
        let mut open = self.open.lock();
        let largest = || open.of.iter().max_by_key(|(_, of)| of.len()).map(|(client, _)| *client);
        let gives = match open.of.get(&client).map_or(0, BTreeMap::len) {
            MAX_OF_CLIENT.. => Some(client),
            _ if open.count >= MAX_CONNECTIONS => largest(),
            _ => None,
        };
        if let Some(gives) = gives
            && let Some(number) = open.least_active(gives, self.now_ms())
        {
            open.end(gives, number);
        }
        open.last += 1;
        open.count += 1;
        let (number, state) = (open.last, Arc::new(State::default()));
        open.of.entry(client).or_default().insert(number, state.clone());
        drop(open);
        let connection = Connection { connections: self.clone(), client, number, state };
        connection.note_progress();
        connection
    }

    /// Returns the number of open connections.
    pub fn count(&self) -> usize {
        self.open.lock().count
    }

    fn now_ms(&self) -> u64 {
        u64::try_from(self.since.elapsed().as_millis()).unwrap_or(u64::MAX)
    }
}

impl State {
    /// Returns whether nothing was read or written for some time, while no response is being computed.
    fn is_stalled(&self, now_ms: u64, time: Duration) -> bool {
        let since = Duration::from_millis(now_ms.saturating_sub(self.progress_ms()));
        since >= time && !self.is_busy.load(Ordering::Relaxed)
    }

    fn progress_ms(&self) -> u64 {
        self.progress_ms.load(Ordering::Relaxed)
    }
}

impl Open {
    /// Returns the connection of a client to close: the one without progress for longest, preferably an idle one.
    fn least_active(&self, client: Client, now_ms: u64) -> Option<u64> {
        let of_client = self.of.get(&client)?.iter();
        let least = of_client
            .min_by_key(|(number, state)| (!state.is_stalled(now_ms, IDLE), state.progress_ms(), **number));
        least.map(|(number, _)| *number)
    }

    fn end(&mut self, client: Client, number: u64) {
        if let Some(state) = self.remove(client, number) {
            log::debug!("closed a connection to accept another one");
            state.end.notify_one();
        }
    }

    fn remove(&mut self, client: Client, number: u64) -> Option<Arc<State>> {
        let of_client = self.of.get_mut(&client)?;
        let removed = of_client.remove(&number)?;
        if of_client.is_empty() {
            self.of.remove(&client);
        }
        self.count -= 1;
        Some(removed)
    }
}

impl Connection {
    pub fn client(&self) -> Client {
        self.client
    }

    /// Records that bytes were read or written.
    pub fn note_progress(&self) {
        self.state.progress_ms.store(self.connections.now_ms(), Ordering::Relaxed);
    }

    /// Records whether a response is being computed.
    pub fn set_busy(&self, is_busy: bool) {
        self.state.is_busy.store(is_busy, Ordering::Relaxed);
    }

    /// Marks the connection as an event stream.
    pub fn begin_events(&self) {
        let mut open = self.connections.open.lock();
        open.last_stream += 1;
        self.state.stream.store(open.last_stream, Ordering::Relaxed);
        let streams = open.of.get(&self.client).into_iter().flatten();
        let streams = streams.map(|(number, state)| (state.stream.load(Ordering::Relaxed), *number));
        let streams: Vec<_> = streams.filter(|(stream, _)| *stream > 0).collect();
        if streams.len() > MAX_EVENTS_OF_CLIENT
            && let Some((_, oldest)) = streams.into_iter().min()
        {
            open.end(self.client, oldest);
        }
    }

    /// Closes stalled connections of all clients that hold unsent responses in memory.
    pub fn end_stalled(&self) {
        let now_ms = self.connections.now_ms();
        let mut open = self.connections.open.lock();
        let all = open
            .of
            .iter()
            .flat_map(|(client, of)| of.iter().map(|(number, state)| (*client, *number, state)));
        let is_stalled =
            |state: &State| state.held_bytes.load(Ordering::Relaxed) > 0 && state.is_stalled(now_ms, STALLED);
        let stalled: Vec<_> =
            all.filter(|(.., state)| is_stalled(state)).map(|(client, number, _)| (client, number)).collect();
        stalled.into_iter().for_each(|(client, number)| open.end(client, number));
    }

    /// Counts bytes of a response as held by this connection until the returned value is dropped.
    pub fn hold(&self, bytes: usize) -> HeldBytes {
        self.state.held_bytes.fetch_add(bytes, Ordering::Relaxed);
        HeldBytes { state: self.state.clone(), bytes }
    }

    /// Waits until the connection must be closed.
    pub async fn ended(&self) {
        self.state.end.notified().await;
    }
}

/// Bytes of a response that the client has not read yet.
pub struct HeldBytes {
    state: Arc<State>,
    bytes: usize,
}

impl Drop for HeldBytes {
    fn drop(&mut self) {
        self.state.held_bytes.fetch_sub(self.bytes, Ordering::Relaxed);
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.connections.open.lock().remove(self.client, self.number);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn client(number: u8) -> Client {
        Client::of(IpAddr::from([10, 0, 0, number]))
    }

    fn is_open(connection: &Connection) -> bool {
        let open = connection.connections.open.lock();
        open.of.get(&connection.client).is_some_and(|of| of.contains_key(&connection.number))
    }

    /// Returns connections opened ten seconds ago.
    fn long_ago() -> Connections {
        let now = Instant::now();
        Connections { since: now.checked_sub(Duration::from_secs(10)).unwrap_or(now), ..Connections::new() }
    }

    fn set_progress(connection: &Connection, ms: u64) {
        connection.state.progress_ms.store(ms, Ordering::Relaxed);
    }

    #[test]
    fn too_many_connections_of_a_client_close_its_idle_ones() {
        let connections = long_ago();
        let other = connections.enter(client(2));
        let of_client: Vec<_> = (0..MAX_OF_CLIENT).map(|_| connections.enter(client(1))).collect();
        of_client.iter().for_each(|connection| set_progress(connection, 1000));
        set_progress(&other, 0);
        set_progress(&of_client[7], 10);
        set_progress(&of_client[9], 5);
        of_client[9].set_busy(true);
        let next = connections.enter(client(1));
        let closed: Vec<_> = (0..MAX_OF_CLIENT).filter(|&k| !is_open(&of_client[k])).collect();
        assert_eq!(closed, [7]);
        assert!(is_open(&other) && is_open(&next));
        // Dropping a closed connection releases no second slot.
        drop(of_client);
        assert_eq!(connections.open.lock().count, 2);
    }

    #[test]
    fn without_idle_connections_the_oldest_is_closed() {
        let connections = long_ago();
        let busy: Vec<_> = (0..MAX_OF_CLIENT).map(|_| connections.enter(client(1))).collect();
        for (number, connection) in busy.iter().enumerate() {
            connection.set_busy(true);
            set_progress(connection, 1000 + number as u64);
        }
        // A connection with an unread request is not idle.
        let (next, one_more) = (connections.enter(client(1)), connections.enter(client(1)));
        assert!(is_open(&next) && is_open(&one_more));
        assert!(!is_open(&busy[0]) && !is_open(&busy[1]) && busy[2..].iter().all(is_open));
    }

    #[test]
    fn without_free_slots_the_client_with_most_connections_loses_one() {
        let connections = Connections::new();
        let most: Vec<_> = (0..MAX_OF_CLIENT).map(|_| connections.enter(client(1))).collect();
        let others: Vec<_> = (0..MAX_CONNECTIONS - MAX_OF_CLIENT)
            .map(|number| connections.enter(client(2 + (number % 200) as u8)))
            .collect();
        let next = connections.enter(client(250));
        assert_eq!(most.iter().filter(|connection| !is_open(connection)).count(), 1);
        assert!(is_open(&next) && others.iter().all(is_open));
        assert_eq!(connections.open.lock().count, MAX_CONNECTIONS);
    }

    #[test]
    fn the_oldest_event_stream_is_closed_for_a_new_one() {
        let connections = Connections::new();
        let plain = connections.enter(client(1));
        let streams: Vec<_> = (0..=MAX_EVENTS_OF_CLIENT)
            .map(|_| {
                let connection = connections.enter(client(1));
                connection.begin_events();
                connection
            })
            .collect();
        assert!(!is_open(&streams[0]) && streams[1..].iter().all(is_open) && is_open(&plain));
        // The age of the stream counts, not that of the connection.
        plain.begin_events();
        assert!(!is_open(&streams[1]) && streams[2..].iter().all(is_open) && is_open(&plain));
    }

    #[test]
    fn stalled_connections_are_closed_when_memory_is_short() {
        let connections = long_ago();
        let [asks, idle, stream, takes, stalled] =
            [1, 1, 1, 2, 3].map(|number| connections.enter(client(number)));
        stream.begin_events();
        let _held = [&takes, &stalled].map(|connection| connection.hold(1 << 20));
        for connection in [&idle, &stream, &stalled] {
            set_progress(connection, 0);
        }
        asks.end_stalled();
        assert!(!is_open(&stalled) && [&asks, &idle, &stream, &takes].into_iter().all(is_open));
        drop(stalled.hold(1));
        assert_eq!(stalled.state.held_bytes.load(Ordering::Relaxed), 1 << 20);
    }

    #[test]
    fn a_network_is_one_client() {
        let of = |address: &str| Client::of(address.parse().unwrap());
        assert_eq!(of("2001:db8::1"), of("2001:db8::ffff:1"));
        assert_ne!(of("2001:db8::1"), of("2001:db8:0:1::1"));
        for local in ["fe80", "fd00"] {
            assert_ne!(of(&format!("{local}::1")), of(&format!("{local}::2")));
        }
        assert_eq!(of("::ffff:10.0.0.1"), of("10.0.0.1"));
        assert_ne!(of("10.0.0.1"), of("10.0.0.2"));
    }
}
