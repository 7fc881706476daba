use crate::comparison::ServedComparison;
use crate::served_map::ServedMap;
use crate::server::Server;
use crate::token::Token;
use anyhow::Context;
use std::fmt;
use std::net::{IpAddr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use tokio::sync::watch;
use voxtile::Error;
use voxtile_compare::CompareOptions;

/// Receives the numbers of tiles read and of all tiles of a map, from any thread.
pub type Progress = Arc<dyn Fn(u64, u64) + Send + Sync>;

/// Maps to show and the address of the server.
pub struct ViewOptions {
    /// Folders of maps, `FOLDER@SNAPSHOT`, OctoMap files, or URLs of maps; each is a layer.
    pub maps: Vec<PathBuf>,
    /// Later map, with which the only one of `maps` is compared.
    pub compare: Option<CompareWith>,
    /// Address and port of the server; port 0 selects a free one.
    pub listen: SocketAddr,
    /// Secret part of the URL, 8 to 128 characters of `A-Z a-z 0-9 _ -`; `None` for a random one.
    pub token: Option<String>,
    /// Whether coarse levels are stored in the user's cache folder for the next time.
    pub keeps_levels: bool,
    /// Receives the progress of the first read of each map.
    pub progress: Progress,
}

/// Map to compare with, and how.
pub struct CompareWith {
    /// Path, as in [`ViewOptions::maps`].
    pub map: PathBuf,
    /// Options of the comparison.
    pub options: CompareOptions,
    /// Receives the numbers of blocks of voxels done and in total, twice.
    pub progress: Progress,
}

impl fmt::Debug for CompareWith {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut out = formatter.debug_struct("CompareWith");
        out.field("map", &self.map).field("options", &self.options).finish_non_exhaustive()
    }
}

impl fmt::Debug for ViewOptions {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Omit the secret token.
        let Self { maps, compare, listen, keeps_levels, .. } = self;
        let mut out = formatter.debug_struct("ViewOptions");
        out.field("maps", maps)
            .field("compare", compare)
            .field("listen", listen)
            .field("keeps_levels", keeps_levels);
        out.finish_non_exhaustive()
    }
}

/// Open maps and a listening socket; [`View::serve`] runs the server.
pub struct View {
    server: Server,
    listener: TcpListener,
    address: SocketAddr,
    url: String,
}

impl fmt::Debug for View {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("View").field("address", &self.address).finish_non_exhaustive()
    }
}

impl View {
    /// Opens the maps and starts to listen. Threads read the maps from here on and follow changes by other processes.
    ///
    /// # Errors
    ///
    /// Fails if a map cannot be opened or compared, the token is invalid, or the address is not available.
    pub fn open(options: &ViewOptions) -> anyhow::Result<Self> {
        voxtile_monitoring::note_start();
        let token = match &options.token {
            Some(token) => Token::new(token)?,
            None => Token::random()?,
        };
        // Counts visible changes of all maps.
        let (changes, changed) = watch::channel(0_u64);
        let paths = options.maps.iter().chain(options.compare.as_ref().map(|compare| &compare.map));
        let maps = paths
            .map(|path| ServedMap::open(path, options.keeps_levels, options.progress.clone()))
            .collect::<anyhow::Result<Vec<_>>>()?;
        let maps: Vec<Arc<ServedMap>> = maps.into_iter().map(Arc::new).collect();
        let comparison = comparison_of(options)?.map(Arc::new);
        let listener = TcpListener::bind(options.listen)
            .with_context(|| format!("`listen`: cannot use {}", options.listen))?;
        let address = listener.local_addr()?;
        let url = url_of(address, &token);
        for map in &maps {
            map.clone().follow(changes.clone())?;
        }
        Ok(Self { server: Server::new(maps, comparison, token, address, changed), listener, address, url })
    }

    /// Returns the URL of the page, including its secret part.
    pub fn url(&self) -> &str {
        &self.url
    }

    /// Returns the address and port of the server.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Runs the server until a signal.
    ///
    /// # Errors
    ///
    /// Fails if the system provides no threads or no connections.
    pub fn serve(self) -> anyhow::Result<()> {
        self.server.run(self.listener)
    }
}

fn comparison_of(options: &ViewOptions) -> anyhow::Result<Option<ServedComparison>> {
    let Some(CompareWith { map, options: how, progress }) = &options.compare else { return Ok(None) };
    let [before] = &options.maps[..] else {
        let reason = "needs exactly two maps: `voxtile view BEFORE --compare AFTER`";
        return Err(Error::argument("compare", reason).into());
    };
    Ok(Some(ServedComparison::of([before, map], how, progress)?))
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
