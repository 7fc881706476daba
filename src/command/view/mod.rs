//! `voxtile view`: maps in a browser.
//!
//! ```text
//! request -> server    timeouts, threads                            server, work
//!                      connections, and how many a client has       connections, client_stream
//!                      what answers that are being sent hold        answer_memory
//!         -> Route     what a path asks for, or nothing             route, token
//!         -> answers   JSON of a query, a tileset, bytes of a node  answers
//!            ServedMap one map, followed while somebody writes it   served_map
//!            MapState  one state of it: a flush, a snapshot         map_state, node_cache
//! ```
//!
//! The page is `view/dist`, made by `view/bundle.sh`. docs/view.md has the interface.

mod answer_memory;
mod answers;
mod client_stream;
mod connections;
mod map_state;
mod node_cache;
mod page;
mod response;
mod route;
mod served_map;
mod server;
mod token;
mod work;

use crate::command::args::ViewArgs;
use crate::command::json;
use anyhow::Context;
use served_map::ServedMap;
use server::Server;
use std::io::{IsTerminal, Write};
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::process::ExitCode;
use std::sync::Arc;
use token::Token;
use tokio::sync::watch;

pub fn run(args: &ViewArgs) -> anyhow::Result<ExitCode> {
    let token = match &args.token {
        Some(token) => Token::new(token)?,
        None => Token::random()?,
    };
    // Counts whatever becomes visible, in any map.
    let (changes, changed) = watch::channel(0_u64);
    let maps = args
        .maps
        .iter()
        .map(|path| ServedMap::open(path, !args.no_cache))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let maps: Vec<Arc<ServedMap>> = maps.into_iter().map(Arc::new).collect();
    let listener =
        TcpListener::bind(args.listen).with_context(|| format!("--listen: cannot use {}", args.listen))?;
    let address = listener.local_addr()?;
    let url = url_of(address, &token);
    tell(args, &url, address)?;
    for map in &maps {
        map.clone().follow(changes.clone())?;
    }
    if !args.no_browser && !args.json && std::io::stdout().is_terminal() && has_screen() {
        // A browser that does not start is no reason to stop: the URL is on the screen.
        if let Err(error) = open::that_detached(&url) {
            log::info!("no browser: {error}");
        }
    }
    Server::new(maps, token, address, changed).run(listener)?;
    Ok(ExitCode::SUCCESS)
}

fn url_of(address: SocketAddr, token: &Token) -> String {
    let host = match address.ip() {
        IpAddr::V4(ip) if ip.is_unspecified() => "127.0.0.1".to_owned(),
        IpAddr::V6(ip) if ip.is_unspecified() => "[::1]".to_owned(),
        IpAddr::V4(ip) => ip.to_string(),
        IpAddr::V6(ip) => format!("[{ip}]"),
    };
    format!("http://{host}:{}/{}/", address.port(), token.as_str())
}

fn tell(args: &ViewArgs, url: &str, address: SocketAddr) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if args.json {
        json::print(&serde_json::json!({ "url": url, "listen": address.to_string() }), &mut out)?;
        return Ok(out.flush()?);
    }
    writeln!(out, "open {url}")?;
    if address.ip().is_loopback() && std::env::var_os("SSH_CONNECTION").is_some() {
        let port = address.port();
        writeln!(out, "from another machine, after: ssh -L {port}:127.0.0.1:{port} THIS_MACHINE")?;
    }
    writeln!(out, "Ctrl-C ends it")?;
    Ok(out.flush()?)
}

/// Whether there is a screen that a browser could use.
fn has_screen() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(target_os = "linux") || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}
