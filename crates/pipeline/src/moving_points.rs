use voxtile::mapper::MapReader;
use voxtile::scan::{MovingMarks, ScanPoints};
use voxtile::store::KeptRecord;
use voxtile::{Point, Result};

/// Reads the points of a map's kept scans that are marked as moving, one scan at a time. `take` receives some of them,
/// in metres, world frame, in the order of the scans. Only the scans that have such points and that `is_wanted` accepts
/// are read.
///
/// # Errors
///
/// The map keeps no scans, or they are damaged or cannot be read.
pub fn read_moving_points(
    map: &MapReader,
    mut is_wanted: impl FnMut(&KeptRecord) -> bool,
    mut take: impl FnMut(&[Point]),
) -> Result<()> {
    let (mut scans, mut moving) = (map.kept_scans()?, Vec::new());
    while let Some(record) = scans.next_record()? {
        if record.moving.is_none() || !is_wanted(&record) {
            continue;
        }
        let scan = scans.open(record)?;
        let Some(mut marks) = scan.moving().map(MovingMarks::iter) else { continue };
        scan.for_each_chunk(0..scan.len(), &mut |points, _| {
            moving.clear();
            moving.extend(points.iter().filter(|_| marks.next().unwrap_or(false)));
            take(&moving);
            true
        })?;
    }
    Ok(())
}
