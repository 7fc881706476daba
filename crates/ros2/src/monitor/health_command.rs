use crate::listen_address::ListenAddress;
use clap::Parser;
use std::ffi::OsString;
use std::io::{self, Read as _, Write as _};
use std::net::TcpStream;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// Check a node that runs with --metrics. Exits with 0 if it is healthy, otherwise with 1
#[derive(Debug, Parser)]
#[command(name = "voxtile-ros2 health", max_term_width = 80)]
struct HealthArgs {
    /// Address of the node's --metrics; a port alone is on this machine
    #[arg(value_name = "[ADDRESS:]PORT")]
    address: ListenAddress,
    /// Give up after this time
    #[arg(long, value_name = "S", default_value_t = 5, value_parser = clap::value_parser!(u64).range(1..=3600))]
    timeout: u64,
}

const MAX_BYTES: u64 = 64 << 10;

/// Runs `voxtile-ros2 health` if the arguments name it, the program first.
pub fn health_command(arguments: &[OsString]) -> Option<ExitCode> {
    let (_, own) =
        arguments.split_first().filter(|(_, own)| own.first().is_some_and(|own| own == "health"))?;
    let HealthArgs { address, timeout } = HealthArgs::parse_from(own);
    let (is_healthy, text) = match asked(address, Duration::from_secs(timeout)) {
        Ok(answer) => answer,
        Err(error) => (false, format!("no answer from {address}: {error}")),
    };
    // The exit code is the result: a closed standard output does not matter.
    let _ = writeln!(io::stdout(), "{text}");
    Some(if is_healthy { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Returns whether the node is healthy, with its explanation.
///
/// # Errors
///
/// The node does not answer in time.
fn asked(ListenAddress(address): ListenAddress, timeout: Duration) -> io::Result<(bool, String)> {
    let deadline = Instant::now() + timeout;
    let mut stream = TcpStream::connect_timeout(&address, timeout)?;
    stream.set_write_timeout(Some(timeout))?;
    stream.write_all(
        format!("GET /health HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes(),
    )?;
    let (mut response, mut part) = (Vec::new(), [0; 4096]);
    while (response.len() as u64) < MAX_BYTES {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(io::ErrorKind::TimedOut.into());
        }
        stream.set_read_timeout(Some(left))?;
        match stream.read(&mut part)? {
            0 => break,
            bytes => response.extend(part.iter().take(bytes)),
        }
    }
    let response = String::from_utf8_lossy(&response);
    let (head, body) = response.split_once("\r\n\r\n").unwrap_or((&response, ""));
    let status = head.lines().next().unwrap_or_default();
    match status.split(' ').nth(1) {
        Some("200") => Ok((true, body.trim().to_owned())),
        Some("503") => Ok((false, body.trim().to_owned())),
        _ => Err(io::Error::other(format!("{status:?} is not a response of voxtile-ros2"))),
    }
}
