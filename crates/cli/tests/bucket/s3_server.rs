use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

/// Local server with the part of S3 that voxtile uses, and with injected faults. It ends with the process.
pub struct S3Server {
    pub address: SocketAddr,
    state: Arc<State>,
}

struct State {
    objects: Mutex<BTreeMap<String, Vec<u8>>>,
    requests: Mutex<Vec<SeenRequest>>,
    trouble: Mutex<Arc<Troubles>>,
}

/// Selects the fault for a request, given the number of earlier requests.
type Troubles = dyn Fn(&SeenRequest, usize) -> Trouble + Send + Sync;

#[derive(Clone, Debug)]
pub struct SeenRequest {
    pub method: String,
    /// Path, including the bucket.
    pub key: String,
    /// Number of bytes written.
    pub bytes: usize,
    /// First requested byte.
    pub from: Option<usize>,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Trouble {
    None,
    /// Reads the request without a response.
    Silent,
    /// Responds after a delay in milliseconds.
    Late(u64),
    /// Resets the connection before reading the request.
    Reset,
    /// Executes the request and closes the connection without a response.
    AnswerLost,
    /// Sends this number of content bytes every 20 ms.
    Drips(usize),
    /// Sends half of the content and then stalls.
    Stalls,
    /// Sends half of the content and closes the connection.
    CutOff,
}

const LONG: Duration = Duration::from_secs(120);

impl S3Server {
    pub fn new() -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let trouble: Arc<Troubles> = Arc::new(|_, _| Trouble::None);
        let trouble = Mutex::new(trouble);
        let state = Arc::new(State { objects: Mutex::default(), requests: Mutex::default(), trouble });
        let serving = state.clone();
        thread::spawn(move || {
            for stream in listener.incoming() {
                let (stream, state) = (stream.unwrap(), serving.clone());
                // Ignore errors of clients that disconnect early.
                thread::spawn(move || state.serve(stream).unwrap_or_default());
            }
        });
        Self { address, state }
    }

    /// Sets the faults of all later requests, numbered from 0.
    pub fn trouble(&self, trouble: impl Fn(&SeenRequest, usize) -> Trouble + Send + Sync + 'static) {
        self.state.requests.lock().unwrap().clear();
        *self.state.trouble.lock().unwrap() = Arc::new(trouble);
    }

    /// Returns the requests since the last call of `trouble`.
    pub fn requests(&self) -> Vec<SeenRequest> {
        self.state.requests.lock().unwrap().clone()
    }

    pub fn put(&self, key: &str, content: Vec<u8>) {
        self.state.objects.lock().unwrap().insert(key.to_owned(), content);
    }

    pub fn has_manifest(&self) -> bool {
        self.state.objects.lock().unwrap().keys().any(|key| key.ends_with("manifest.json"))
    }

    /// Returns a command with this server as endpoint.
    pub fn voxtile(&self, arguments: &[&str]) -> Command {
        // A shell that runs tests in the background ignores SIGINT, and the child would inherit that.
        let mut command = Command::new("env");
        command.arg("--default-signal=INT").arg(assert_cmd::cargo::cargo_bin("voxtile"));
        let endpoint = format!("http://{}", self.address);
        command.args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.env("AWS_ENDPOINT_URL", endpoint).env("AWS_REGION", "test");
        command.env("AWS_ACCESS_KEY_ID", "test").env("AWS_SECRET_ACCESS_KEY", "test");
        command.env_remove("RUST_LOG").env_remove("VOXTILE_BUCKET_TIMEOUT");
        command
    }
}

impl State {
    fn serve(&self, mut stream: TcpStream) -> std::io::Result<()> {
        // Read the rest of the request: closing with unread data resets the connection.
        let mut head = [0; 4096];
        let mut peeked = 0;
        let since = Instant::now();
        while !head[..peeked].windows(4).any(|end| end == b"\r\n\r\n") && since.elapsed() < LONG {
            peeked = stream.peek(&mut head)?;
            if peeked == 0 {
                return Ok(());
            }
        }
        let first = String::from_utf8_lossy(&head[..peeked]).into_owned();
        let mut words = first.split(' ');
        let (method, key) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
        let key = key.trim_start_matches('/').to_owned();
        let first_lower = first.to_ascii_lowercase();
        let number = |name: &str| {
            let value = first_lower.split(name).nth(1)?;
            value.split(|letter: char| !letter.is_ascii_digit()).next()?.parse().ok()
        };
        let (bytes, from) = (number("\ncontent-length: ").unwrap_or(0), number("\nrange: bytes="));
        let request = SeenRequest { method: method.to_owned(), key, bytes, from };
        let (trouble, number) = {
            let mut all = self.requests.lock().unwrap();
            all.push(request.clone());
            (self.trouble.lock().unwrap().clone(), all.len() - 1)
        };
        let trouble = trouble(&request, number);
        if trouble == Trouble::Reset {
            return Ok(());
        }
        let mut input = BufReader::new(stream.try_clone()?);
        let mut headers = BTreeMap::new();
        let mut line = String::new();
        while input.read_line(&mut line)? > 2 {
            if let Some((name, value)) = line.split_once(':') {
                headers.insert(name.to_ascii_lowercase(), value.trim().to_owned());
            }
            line.clear();
        }
        let length = headers.get("content-length").and_then(|length| length.parse().ok()).unwrap_or(0);
        let mut body = vec![0; length];
        input.read_exact(&mut body)?;
        if trouble == Trouble::Silent {
            thread::sleep(LONG);
            return Ok(());
        }
        if let Trouble::Late(milliseconds) = trouble {
            thread::sleep(Duration::from_millis(milliseconds));
        }
        let (status, content, range) = self.answer(&request, &headers, body);
        if trouble == Trouble::AnswerLost {
            return Ok(());
        }
        let e_tag =
            blake3::hash(&self.objects.lock().unwrap().get(&request.key).cloned().unwrap_or_default());
        write!(
            stream,
            "HTTP/1.1 {status} Test\r\nContent-Length: {}\r\nETag: \"{}\"\r\n{range}\
             Last-Modified: Thu, 26 Nov 2026 09:00:00 GMT\r\nConnection: close\r\n\r\n",
            content.len(),
            e_tag.to_hex()
        )?;
        if request.method == "HEAD" {
            return Ok(());
        }
        match trouble {
            Trouble::Drips(bytes) => {
                for drop in content.chunks(bytes) {
                    stream.write_all(drop)?;
                    thread::sleep(Duration::from_millis(20));
                }
            }
            Trouble::Stalls | Trouble::CutOff => {
                stream.write_all(&content[..content.len() / 2])?;
                thread::sleep(if trouble == Trouble::Stalls { LONG } else { Duration::ZERO });
            }
            _ => stream.write_all(&content)?,
        }
        Ok(())
    }

    /// Returns status, content and the range header.
    fn answer(
        &self,
        request: &SeenRequest,
        headers: &BTreeMap<String, String>,
        body: Vec<u8>,
    ) -> (u16, Vec<u8>, String) {
        let mut objects = self.objects.lock().unwrap();
        let there = objects.get(&request.key).cloned();
        let e_tag = there.as_ref().map(|there| format!("\"{}\"", blake3::hash(there).to_hex()));
        if headers.get("if-match").is_some_and(|wanted| e_tag.as_ref() != Some(wanted)) {
            return (412, Vec::new(), String::new());
        }
        if request.method == "PUT" {
            if headers.contains_key("if-none-match") && there.is_some() {
                return (412, Vec::new(), String::new());
            }
            objects.insert(request.key.clone(), body);
            return (200, Vec::new(), String::new());
        }
        let Some(content) = there else {
            return (404, b"<Error><Code>NoSuchKey</Code></Error>".to_vec(), String::new());
        };
        let Some(range) = headers.get("range").and_then(|range| range.strip_prefix("bytes=")) else {
            return (200, content, String::new());
        };
        let (from, to) = range.split_once('-').unwrap();
        let (from, to): (usize, usize) = (from.parse().unwrap(), to.parse().unwrap());
        let to = to.min(content.len() - 1);
        let reported = format!("Content-Range: bytes {from}-{to}/{}\r\n", content.len());
        (206, content[from..=to].to_vec(), reported)
    }
}
