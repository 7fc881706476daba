use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;

/// Starts a web server that returns one file for every path and ignores ranges. It ends with the process.
pub fn serve_whole(content: Vec<u8>) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    let content = Arc::new(content);
    thread::spawn(move || {
        for stream in listener.incoming() {
            let (stream, content) = (stream.unwrap(), content.clone());
            thread::spawn(move || answer(stream, &content));
        }
    });
    address
}

fn answer(mut stream: TcpStream, content: &[u8]) {
    let mut lines = BufReader::new(stream.try_clone().unwrap()).lines();
    let Some(Ok(first)) = lines.next() else { return };
    while lines.next().is_some_and(|line| line.is_ok_and(|line| !line.is_empty())) {}
    let is_of_map = first.contains("manifest.json");
    let status = if is_of_map { "404 Not Found" } else { "200 OK" };
    let content = if is_of_map { &[][..] } else { content };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Length: {}\r\nLast-Modified: Thu, 26 Nov 2026 09:00:00 GMT\r\n\
         Connection: close\r\n\r\n",
        content.len()
    );
    // The client may disconnect early.
    let _ = stream.write_all(head.as_bytes());
    if !first.starts_with("HEAD") {
        let _ = stream.write_all(content);
    }
}
