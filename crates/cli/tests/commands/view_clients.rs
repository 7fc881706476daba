//! `voxtile view` answers authorised clients, whatever other clients do.

use crate::viewer::{TOKEN, Viewer, a_map, read_reply};
use std::fs;
use std::io::Write;
use std::net::TcpStream;
use std::time::{Duration, Instant};

#[test]
fn unauthorised_requests_get_nothing() {
    let (folder, map) = a_map();
    let secret = folder.path().join("secret.txt");
    fs::write(&secret, "secret").unwrap();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let host = viewer.address;
    let reply_to =
        |line: &str, host: &str| viewer.send(&format!("{line}\r\nhost: {host}\r\nconnection: close\r\n\r\n"));
    let host = host.to_string();
    assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), &host).status, 200);
    // Unauthorised clients get no persistent connection; others do.
    let is_closed = |token: &str| {
        let mut stream = viewer.connect();
        write!(stream, "GET /{token}/maps.json HTTP/1.1\r\nhost: {host}\r\n\r\n").unwrap();
        read_reply(stream).head.to_lowercase().contains("connection: close")
    };
    assert_eq!([is_closed("wrong_token"), is_closed(TOKEN)], [true, false]);
    for path in [
        "/".to_owned(),
        "/maps.json".to_owned(),
        "/wrong_token/maps.json".to_owned(),
        format!("/{}/maps.json", &TOKEN[..TOKEN.len() - 1]),
        format!("/{TOKEN}/../secret.txt"),
        format!("/{TOKEN}/../../../../../../etc/passwd"),
        format!("/{TOKEN}//etc/passwd"),
        format!("/{TOKEN}/maps/0/../../secret.txt"),
        format!("/{TOKEN}/maps/0/%2e%2e/%2e%2e/secret.txt"),
        format!("/{TOKEN}/maps/0/metadata.json"),
        format!("/{TOKEN}{}", secret.display()),
        format!("http://elsewhere/{TOKEN}x/maps.json"),
    ] {
        let reply = reply_to(&format!("GET {path} HTTP/1.1"), &host);
        assert!(reply.status == 404 || reply.status == 400, "{path}: {}", reply.status);
        let body = String::from_utf8_lossy(&reply.body).into_owned();
        assert!(
            !body.contains("secret") && !body.contains("root:") && !body.contains("walls"),
            "{path}: {body}"
        );
    }
    for method in ["POST", "PUT", "DELETE", "OPTIONS", "PATCH"] {
        assert_eq!(reply_to(&format!("{method} /{TOKEN}/maps.json HTTP/1.1"), &host).status, 405, "{method}");
    }
    // DNS rebinding: a page of another site reaches this server by a name of its own.
    for name in ["elsewhere.example", "elsewhere.example:80", "", "127.0.0.1.elsewhere.example"] {
        assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), name).status, 403, "{name}");
    }
    assert_eq!(reply_to(&format!("GET /{TOKEN}/maps.json HTTP/1.1"), "localhost:1").status, 200);
    let head = reply_to(&format!("HEAD /{TOKEN}/maps.json HTTP/1.1"), &host);
    assert_eq!((head.status, head.body.len()), (200, 0));
    let page = viewer.get("");
    assert_eq!(page.status, 200);
    assert!(
        page.head.contains("frame-ancestors 'none'") && page.head.contains("no-referrer"),
        "{}",
        page.head
    );
    // Without the trailing slash the page's relative links would be wrong.
    let slash = viewer.send(&format!("GET /{TOKEN} HTTP/1.1\r\nhost: {host}\r\nconnection: close\r\n\r\n"));
    assert!(slash.status == 308 && slash.head.contains(&format!("location: /{TOKEN}/")), "{}", slash.head);
}

#[test]
fn many_or_stalled_clients_do_no_harm() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let nodes = viewer.nodes("0");
    let alone = viewer.get(&nodes[0]).body;
    // Some send half a request, some never read, some shut down their socket. All sockets remain open, more than the
    // server accepts at once.
    let silent: Vec<TcpStream> = (0..560)
        .map(|number| {
            let mut stream = viewer.connect();
            let request = format!("GET /{TOKEN}/{} HTTP/1.1\r\nhost: {}\r\n\r\n", nodes[0], viewer.address);
            let sent = if number % 2 == 0 { &request[..20] } else { &request[..] };
            stream.write_all(sent.as_bytes()).unwrap();
            if number % 5 == 0 {
                stream.shutdown(std::net::Shutdown::Both).unwrap();
            }
            stream
        })
        .collect();
    // Wait until the server treats them as idle; before, it might close a newer connection instead.
    std::thread::sleep(Duration::from_millis(1500));
    let before = viewer.resident_bytes();
    std::thread::scope(|scope| {
        let ask = |number: usize| {
            let (viewer, nodes) = (&viewer, &nodes);
            scope.spawn(move || viewer.get(&nodes[number % nodes.len()]))
        };
        let replies: Vec<_> = (0..200).map(ask).collect();
        for (number, reply) in replies.into_iter().enumerate() {
            let reply = reply.join().unwrap();
            assert_eq!(reply.status, 200);
            if number % nodes.len() == 0 {
                assert_eq!(reply.body, alone);
            }
        }
    });
    let grown = viewer.resident_bytes().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    drop(silent);
    assert_eq!(viewer.get("maps.json").status, 200);
}

/// The page's script is the largest response without a map, and is in memory only once.
#[cfg(target_os = "linux")]
#[test]
fn clients_that_read_nothing_hold_little_memory() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    assert!(viewer.get("page.js").body.len() > 500_000);
    let before = viewer.resident_bytes();
    // More than the system's socket buffers hold.
    let request = format!("GET /{TOKEN}/page.js HTTP/1.1\r\nhost: {}\r\n\r\n", viewer.address).repeat(12);
    // A client may have at most 256 connections.
    let silent: Vec<TcpStream> = (0..250)
        .map(|_| {
            let mut stream = viewer.connect();
            stream.write_all(request.as_bytes()).unwrap();
            stream
        })
        .collect();
    // The server is responding to all of them.
    for stream in &silent {
        assert_eq!(stream.peek(&mut [0; 12]).unwrap(), 12);
    }
    std::thread::sleep(Duration::from_millis(500));
    let grown = viewer.resident_bytes().saturating_sub(before);
    assert!(grown < 64 << 20, "{grown} bytes more");
    assert_eq!(viewer.get("maps.json").status, 200);
}

#[test]
fn event_streams_and_silent_connections_block_no_client() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    let ask = |path: &str| {
        let mut stream = viewer.connect();
        let request = format!("GET /{TOKEN}/{path} HTTP/1.1\r\nhost: {}\r\n\r\n", viewer.address);
        stream.write_all(request.as_bytes()).unwrap();
        stream
    };
    let begun = Instant::now();
    let mut open: Vec<TcpStream> = (0..520).map(|_| ask("events")).collect();
    assert_eq!(viewer.get("maps.json").status, 200);
    // The newest event streams remain open.
    assert_eq!(open[519].peek(&mut [0; 12]).unwrap(), 12);
    open.extend((0..520).map(|_| ask("page.js")));
    open.extend((0..520).map(|_| viewer.connect()));
    assert_eq!(viewer.get("maps.json").status, 200);
    assert!(begun.elapsed() < Duration::from_secs(20), "{:?}", begun.elapsed());
    let files = fs::read_dir(format!("/proc/{}/fd", viewer.process.id())).unwrap().count();
    assert!(files < 320, "{files} open files");
}

#[test]
fn an_invalid_request_is_a_client_error() {
    let (folder, map) = a_map();
    let viewer = Viewer::ready(&[&map], &folder.path().join("cache"));
    for path in [
        "maps/0/raycast?from=0,0,0&to=1e6,0,0",
        "maps/0/raycast?from=0,0,0&to=1e300,0,0",
        "maps/0/query?x=1e300&y=0&z=0",
        "maps/0/node/0/2147483647/2147483647/-2147483648.vox",
        "maps/0/subtree/31/2147483647/0/0.json",
        "maps/0@nothing/tileset.json",
        "maps/9/tileset.json",
    ] {
        let reply = viewer.get(path);
        assert!(reply.status < 500, "{path}: {} {}", reply.status, String::from_utf8_lossy(&reply.body));
    }
    let far = viewer.get("maps/0/raycast?from=0,0,0&to=1e6,0,0");
    let printed = String::from_utf8_lossy(&far.body).into_owned();
    assert!(far.status == 400 && printed.contains("more than the limit of"), "{}: {printed}", far.status);
}
