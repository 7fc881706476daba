use std::collections::BTreeMap;
use voxtile::mapper::MapView;
use voxtile::scan::OFFSETS_PER_VOXEL;
use voxtile::space::{Point, VoxelIndex};
use voxtile::tile::{ClassVotes, TimeSpan};
use voxtile::{MapConfig, VoxelLayers};

/// Layers of every hit voxel.
pub type LayerSums = BTreeMap<VoxelIndex, VoxelLayers>;

/// Attributes of one point.
#[derive(Clone, Copy, Default)]
pub struct PointSample {
    /// `None` if the scan has no intensities; may be NaN.
    pub intensity: Option<f32>,
    pub colour: Option<[u8; 3]>,
    pub class: Option<u8>,
    pub stamp_ns: Option<i64>,
}

/// Adds a point to the voxel that it hit.
pub fn add_hit(sums: &mut LayerSums, config: &MapConfig, point: Point, sample: PointSample) {
    let (layers, grid) = (config.layers(), &config.grid);
    let Some(voxel) = grid.voxel_of(point).filter(|_| !layers.is_none()) else { return };
    let sum = sums.entry(voxel).or_default();
    sum.points += 1;
    if let (true, Some([red, green, blue])) = (layers.colour, sample.colour) {
        sum.colour.points += 1;
        sum.colour.red += u64::from(red);
        sum.colour.green += u64::from(green);
        sum.colour.blue += u64::from(blue);
    }
    if let (Some(max), Some(intensity)) = (layers.intensity_max, sample.intensity.filter(|it| !it.is_nan())) {
        let stored = (f64::from(intensity) / f64::from(max) * 65535.0).round().clamp(0.0, 65535.0) as u64;
        sum.intensity.points += 1;
        sum.intensity.sum += stored;
        sum.intensity.squares += stored * stored;
    }
    if let (true, Some(class)) = (layers.class, sample.class) {
        match sum.classes.iter_mut().find(|votes| votes.class == class) {
            Some(votes) => votes.votes += 1,
            None => sum.classes.push(ClassVotes { class, votes: 1 }),
        }
        sum.classes.sort_by_key(|votes| votes.class);
    }
    if let (true, Some(now)) = (layers.time, sample.stamp_ns) {
        let span = sum.time.unwrap_or(TimeSpan { first_ns: now, last_ns: now });
        sum.time = Some(TimeSpan { first_ns: span.first_ns.min(now), last_ns: span.last_ns.max(now) });
    }
    if layers.shape {
        let units = grid.to_voxel_units(point);
        let edge = f64::from(OFFSETS_PER_VOXEL);
        let offset: [i64; 3] =
            std::array::from_fn(|k| ((units[k] - f64::from(voxel[k])) * edge).floor() as i64 - 512);
        (0..3).for_each(|k| sum.shape.offsets[k] += offset[k]);
        for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].into_iter().enumerate() {
            sum.shape.products[k] += offset[a] * offset[b];
        }
    }
}

/// Layers of all hit voxels of a map.
pub fn layers_of(view: &impl MapView) -> LayerSums {
    let mut all = LayerSums::new();
    for tile in view.tiles() {
        let tile = tile.expect("a readable tile");
        if let Some(layers) = tile.table().layers() {
            layers.for_each(|code, sums| {
                let voxel = tile.index_of(code);
                assert!(tile.evidence(voxel).is_some(), "{voxel:?} was not observed");
                assert_eq!(tile.layers_of(voxel).as_ref(), Some(&sums));
                assert_eq!(all.insert(voxel, sums), None, "{voxel:?} occurs twice");
            });
        }
    }
    all
}
