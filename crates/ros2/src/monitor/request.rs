use std::io::{self, Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// Maximum size of the head of a request.
const MAX_HEAD_BYTES: usize = 8 << 10;
/// A client that has not sent its request or read the response within this time is disconnected.
const TIMEOUT: Duration = Duration::from_secs(5);

/// Response to a request.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Response {
    pub status: &'static str,
    pub content_type: &'static str,
    pub body: String,
}

impl Response {
    pub fn text(status: &'static str, body: impl Into<String>) -> Self {
        Self { status, content_type: "text/plain; charset=utf-8", body: body.into() }
    }
}

/// Reads a request of HTTP/1 and sends the response for its path.
///
/// # Errors
///
/// The client is too slow or has disconnected.
pub fn answer(stream: &mut TcpStream, respond: impl FnOnce(&str) -> Response) -> io::Result<()> {
    let (deadline, mut head) = (Instant::now() + TIMEOUT, Vec::new());
    let mut part = [0; 1024];
    stream.set_nonblocking(false)?;
    stream.set_write_timeout(Some(TIMEOUT))?;
    while !head.windows(4).any(|end| end == b"\r\n\r\n") {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || head.len() > MAX_HEAD_BYTES {
            return send(stream, &Response::text("400 Bad Request", "incomplete request\n"), false);
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut part)? {
            0 => return Ok(()),
            bytes => head.extend(part.iter().take(bytes)),
        }
    }
    let head = String::from_utf8_lossy(&head);
    let mut words = head.lines().next().unwrap_or_default().split(' ');
    let (method, target, version) = (words.next(), words.next(), words.next());
    let response = match (method, target, version) {
        (Some("GET" | "HEAD"), Some(target), Some("HTTP/1.0" | "HTTP/1.1")) => {
            respond(target.split('?').next().unwrap_or_default())
        }
        (Some(_), Some(_), Some("HTTP/1.0" | "HTTP/1.1")) => {
            Response::text("405 Method Not Allowed", "only GET and HEAD are supported\n")
        }
        _ => Response::text("400 Bad Request", "not a request of HTTP/1\n"),
    };
    send(stream, &response, method == Some("HEAD"))
}

fn send(stream: &mut TcpStream, response: &Response, is_head: bool) -> io::Result<()> {
    let Response { status, content_type, body } = response;
    let allow = if status.starts_with("405") { "Allow: GET, HEAD\r\n" } else { "" };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {content_type}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n\
         X-Content-Type-Options: nosniff\r\n{allow}Connection: close\r\n\r\n",
        body.len()
    );
    stream.write_all(head.as_bytes())?;
    if !is_head {
        stream.write_all(body.as_bytes())?;
    }
    stream.flush()
}
