use crate::Arguments;
use anyhow::Result;
use voxtile::{MapConfig, Scan};
use voxtile_formats::{ReadOptions, open_scans};

/// Name of the set.
pub fn name(arguments: &Arguments) -> String {
    arguments.set.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

pub fn config(arguments: &Arguments) -> Result<MapConfig> {
    Ok(MapConfig::with_resolution(arguments.resolution)?.with_range(0.5, arguments.max_range))
}

/// Passes the scans of the set in order.
pub fn for_each_scan(arguments: &Arguments, mut visit: impl FnMut(&Scan) -> Result<()>) -> Result<()> {
    let mut source = open_scans(&arguments.set.join("scans"), &ReadOptions::default())?;
    while let Some(scan) = source.next_scan()? {
        visit(&scan.into_scan())?;
    }
    Ok(())
}
