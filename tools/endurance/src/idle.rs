use crate::build::remove_folder;
use crate::case::{Case, Limit};
use anyhow::Result;
use report::Stopwatch;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::thread;
use std::time::Duration;
use voxtile::{MapView, Mapper, OutOfCoreTileMapper};

/// A mapper that is idle after some scans, without a flush.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Idle {
    pub case: Case,
    /// Memory limit in bytes, for all that grows.
    pub memory_bytes: usize,
    /// Idle time, in seconds.
    pub idle_s: f64,
    /// Folder of the map. It must not exist, and is removed at the end.
    pub folder: PathBuf,
}

/// Cost of the idle time.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Idled {
    pub wall_s: f64,
    /// CPU time of all threads, in seconds.
    pub cpu_s: f64,
    /// Number of tiles written before the idle time.
    pub saves: u64,
}

/// Waiting time in which threads finish the work of the last scan.
const SETTLING_TIME: Duration = Duration::from_secs(2);

impl Idle {
    /// Measures it in this process.
    ///
    /// # Errors
    ///
    /// Fails if the map cannot be created.
    pub fn run(self) -> Result<Idled> {
        let config = self.case.config(Limit::Bytes(self.memory_bytes))?;
        let mut mapper = OutOfCoreTileMapper::create(&self.folder, config)?;
        for scan in self.case.scans()? {
            mapper.insert_scan(&scan?)?;
        }
        let saves = mapper.statistics().io.saves;
        thread::sleep(SETTLING_TIME);
        let stopwatch = Stopwatch::start()?;
        thread::sleep(Duration::from_secs_f64(self.idle_s));
        let took = stopwatch.stop()?;
        drop(mapper);
        remove_folder(&self.folder)?;
        Ok(Idled { wall_s: took.wall_s, cpu_s: took.cpu_s(), saves })
    }
}
