use log::{Level, Log, Metadata, Record};
use std::sync::atomic::{AtomicU64, Ordering};

/// Logger that counts the records of another one by level.
#[derive(Debug)]
pub struct CountedLog<L>(pub L);

/// Records so far, from `error` to `trace`.
static COUNTS: [AtomicU64; 5] = [const { AtomicU64::new(0) }; 5];

/// Returns the number of log records of this process by level, errors first.
pub fn log_counts() -> impl Iterator<Item = (Level, u64)> {
    Level::iter().zip(&COUNTS).map(|(level, count)| (level, count.load(Ordering::Relaxed)))
}

impl<L: Log> Log for CountedLog<L> {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        self.0.enabled(metadata)
    }

    fn log(&self, record: &Record<'_>) {
        if !self.0.enabled(record.metadata()) {
            return;
        }
        if let Some((_, count)) = Level::iter().zip(&COUNTS).find(|(level, _)| *level == record.level()) {
            count.fetch_add(1, Ordering::Relaxed);
        }
        self.0.log(record);
    }

    fn flush(&self) {
        self.0.flush();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Warnings;

    impl Log for Warnings {
        fn enabled(&self, metadata: &Metadata<'_>) -> bool {
            metadata.level() <= Level::Warn
        }

        fn log(&self, _: &Record<'_>) {}

        fn flush(&self) {}
    }

    #[test]
    fn records_are_counted_by_level() {
        let log = CountedLog(Warnings);
        for level in [Level::Error, Level::Warn, Level::Warn, Level::Info] {
            log.log(&Record::builder().level(level).args(format_args!("x")).build());
        }
        let counts: Vec<(Level, u64)> = log_counts().collect();
        assert_eq!(counts[..3], [(Level::Error, 1), (Level::Warn, 2), (Level::Info, 0)]);
    }
}
