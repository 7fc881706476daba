use std::path::{Path, PathBuf};
use voxtile::Result;
use voxtile_formats::{CloudHead, CloudPoint, CloudSource};
use voxtile_formats::{ReadOptions, open_clouds};

/// Returns the path of a file written by another program; see `tests/fixtures/clouds.py`.
pub fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// Returns a folder of real data in `$VOXTILE_DATA`, by default next to the repository. If it is absent, prints a
/// message and returns `None`.
pub fn shared_data(folder: &str) -> Option<PathBuf> {
    let root = std::env::var_os("VOXTILE_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data"), PathBuf::from);
    let path = root.join(folder);
    if path.is_dir() {
        return Some(path);
    }
    println!("skipped: there is no {} (VOXTILE_DATA may name another folder)", path.display());
    None
}

/// A cloud with its points.
pub type Cloud = (CloudHead, Vec<CloudPoint>);

/// Returns all clouds of a source, or the first error.
pub fn all(source: &mut dyn CloudSource) -> Result<Vec<Cloud>> {
    let mut clouds = Vec::new();
    while let Some(head) = source.next_cloud()? {
        let mut points = Vec::new();
        source.read_points(&mut |point| {
            points.push(point);
            Ok(())
        })?;
        clouds.push((head, points));
    }
    Ok(clouds)
}

pub fn clouds_with(path: &Path, options: &ReadOptions) -> Vec<Cloud> {
    let mut source = open_clouds(path, options).unwrap_or_else(|error| panic!("{error}"));
    all(source.as_mut()).unwrap_or_else(|error| panic!("{error}"))
}

pub fn clouds(path: &Path) -> Vec<Cloud> {
    clouds_with(path, &ReadOptions::default())
}

/// Returns the error, and the number of points read before it.
pub fn failure(path: &Path, options: &ReadOptions) -> (String, usize) {
    let mut points = 0;
    let mut read = || -> Result<()> {
        let mut source = open_clouds(path, options)?;
        while source.next_cloud()?.is_some() {
            source.read_points(&mut |_| {
                points += 1;
                Ok(())
            })?;
        }
        Ok(())
    };
    let error = read().expect_err("it must fail");
    (format!("{error:#}"), points)
}

/// Returns the points of the fixtures, shifted.
pub fn wanted(shift: [f64; 3]) -> Vec<CloudPoint> {
    (0..20)
        .map(f64::from)
        .map(|k| {
            let position_m =
                [0.5 * k - 3.0 + shift[0], 0.25 * k * k - 7.0 + shift[1], 10.0 - 0.125 * k + shift[2]];
            CloudPoint { intensity: 3.0 * k as f32, ..CloudPoint::hit(position_m) }
        })
        .collect()
}

/// Returns random points whose coordinates are floats, with colours and classes. The first point is not black.
pub fn rows_of(count: usize) -> Vec<crate::attributes::Row> {
    let mut state = 7_u64;
    let mut random = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    };
    let mut row = |_| {
        let point = [(); 3].map(|()| (random(1 << 20) as f64 - 524_288.0) / 1024.0);
        let colour = [(); 3].map(|()| random(256) as u8);
        (point, Some(colour), Some(random(24) as u8))
    };
    (0..count).map(&mut row).collect()
}
