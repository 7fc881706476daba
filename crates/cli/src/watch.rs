use crate::progress::Progress;
use std::fmt;
use std::sync::Arc;
use voxtile::scan::Stop;

/// Hears how many scans or tiles are done, and of how many; 0 where that is not known.
pub type Listener = Arc<dyn Fn(u64, u64) + Send + Sync>;

/// Who asked for long work: can end it, and hears how far it is.
#[derive(Clone)]
pub struct Watch {
    stop: Stop,
    ears: Ears,
}

#[derive(Clone)]
enum Ears {
    /// A bar on standard error.
    Terminal,
    /// Another program.
    Program(Listener),
    Nobody,
}

impl Watch {
    /// Another program that carries the command.
    pub fn of_program(stop: Stop, listener: Option<Listener>) -> Self {
        Self { stop, ears: listener.map_or(Ears::Nobody, Ears::Program) }
    }

    /// A person who sees a bar.
    pub(super) fn at_terminal(stop: Stop) -> Self {
        Self { stop, ears: Ears::Terminal }
    }

    /// Whether to stop.
    pub(super) fn stop(&self) -> &Stop {
        &self.stop
    }

    /// Progress over scans.
    pub(super) fn over_scans(&self, scans: Option<usize>) -> Progress {
        self.heard(Progress::over_scans(scans))
    }

    /// Progress over tiles.
    pub(super) fn over_tiles(&self, tiles: usize) -> Progress {
        self.heard(Progress::over_tiles(tiles))
    }

    fn heard(&self, progress: Progress) -> Progress {
        match &self.ears {
            Ears::Terminal => progress,
            Ears::Program(listener) => progress.told_to(Some(listener.clone())),
            Ears::Nobody => progress.told_to(None),
        }
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Watch").field("stop", &self.stop).finish_non_exhaustive()
    }
}
