use crate::build::remove_folder;
use crate::case::{Case, Limit};
use anyhow::Result;
use report::Stopwatch;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;
use voxtile::{MapView, Mapper, OutOfCoreTileMapper};

/// A mapper that has taken scans, is not flushed, and has nothing to do.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Idle {
    /// The scans.
    pub case: Case,
    /// Bytes for all that grows.
    pub memory_bytes: usize,
    /// How long it has nothing to do, in seconds.
    pub idle_s: f64,
    /// Folder of the map, which must not exist and is removed again.
    pub folder: PathBuf,
}

/// What doing nothing took.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Idled {
    /// Time on the wall, in seconds.
    pub wall_s: f64,
    /// CPU time of all threads meanwhile, in seconds.
    pub cpu_s: f64,
    /// Tiles that were written before.
    pub saves: u64,
}

/// How long threads may go on with what the last scan left them to do.
const AFTERWARDS: Duration = Duration::from_secs(2);

impl Idle {
    /// Does nothing in this process.
    ///
    /// # Errors
    ///
    /// A map that cannot be made.
    pub fn run(self) -> Result<Idled> {
        let config = self.case.config(Limit::Bytes(self.memory_bytes))?;
        let mut mapper = OutOfCoreTileMapper::create(&self.folder, config)?;
        for scan in self.case.scans()? {
            mapper.insert_scan(&scan?)?;
        }
        let saves = mapper.statistics().io.saves;
        thread::sleep(AFTERWARDS);
        let stopwatch = Stopwatch::start()?;
        thread::sleep(Duration::from_secs_f64(self.idle_s));
        let took = stopwatch.stop()?;
        drop(mapper);
        remove_folder(&self.folder)?;
        Ok(Idled { wall_s: took.wall_s, cpu_s: took.cpu_s(), saves })
    }
}
