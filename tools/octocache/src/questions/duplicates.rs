//! Figure 8 and table 2: repeated updates of voxels, within a scan and between scans.

use crate::dataset::map_config;
use crate::setting::Setting;
use anyhow::Result;
use report::Answer;
use report::Samples;
use report::plot::{Content, Line, Panel, Plot, Scale};
use report::{Cell, Table};
use rustc_hash::FxHashMap;
use std::collections::VecDeque;
use voxtile::scan::{ScanTracer, ScanUpdates, TileUpdates};
use voxtile::space::{BrickCode, BrickMask, TileIndex};
use voxtile::{InsertMode, MapConfig, Scan};

const RESOLUTIONS_M: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
/// Resolution of the plot.
const PLOTTED_M: f64 = 0.2;
/// Number of previous scans with which a scan is compared.
const EARLIER_SCANS: usize = 3;

/// A set of voxels, brick by brick.
#[derive(Default)]
struct VoxelSet(FxHashMap<(TileIndex, BrickCode), BrickMask>);

/// Counts for a data set at a resolution.
#[derive(Default)]
struct Counts {
    /// Number of updates if every ray counts.
    updates: u64,
    /// Sum of the distinct voxels of each scan.
    of_scans: u64,
    /// Distinct voxels of all scans.
    of_map: u64,
    /// Share of a scan's voxels that are in one of the [`EARLIER_SCANS`] before it, from the fourth scan on.
    overlaps: Samples,
}

pub fn answer(setting: &Setting) -> Result<Answer> {
    let columns = [
        "set",
        "scans",
        "resolution m",
        "distinct voxels",
        "updates of rays",
        "updates a voxel of a scan",
        "updates a voxel of the map",
        "median overlap",
        "scans of >= 80 %",
    ];
    let mut table = Table::new(
        "duplicates",
        "Updates if every ray counts, by the distinct voxels of each scan and of the map; *overlap*: share of a scan's \
         voxels that one of the three scans before has too, and how many scans have at least 80 %.",
        columns,
    );
    let mut lines = Vec::new();
    for dataset in &setting.datasets {
        let scans = dataset.scans(setting.size(30, 5))?;
        for resolution_m in RESOLUTIONS_M.into_iter().skip(setting.size(0, 1)) {
            let counts = count(&map_config(resolution_m)?, &scans)?;
            let overlaps = counts.overlaps.sorted();
            let high = overlaps.iter().filter(|overlap| **overlap >= 0.8).count();
            table.push([
                dataset.name.into(),
                (scans.len() as u64).into(),
                Cell::Number(resolution_m, 1),
                counts.of_map.into(),
                counts.updates.into(),
                Cell::Number(counts.updates as f64 / counts.of_scans as f64, 2),
                Cell::Number(counts.updates as f64 / counts.of_map as f64, 1),
                Cell::Share(counts.overlaps.median()),
                Cell::Share(high as f64 / overlaps.len() as f64),
            ]);
            if resolution_m == PLOTTED_M {
                lines.push(Line { name: dataset.name.to_owned(), points: distribution(&overlaps) });
            }
        }
    }
    let panel = Panel {
        title: format!("voxels of {PLOTTED_M} m"),
        x_label: "share of a scan's voxels that the 3 scans before have too".to_owned(),
        y_label: "share of scans with no more".to_owned(),
        content: Content::Lines { x_scale: Scale::Linear, y_scale: Scale::Linear, lines },
    };
    let caption = "Overlap of a scan with the three scans before it, distribution over the scans".to_owned();
    let plot = Plot { file: "overlap", caption, panels: vec![panel] };
    Ok(Answer { tables: vec![table], plots: vec![plot] })
}

fn count(config: &MapConfig, scans: &[Scan]) -> Result<Counts> {
    let mut counts = Counts::default();
    let mut tracer = ScanTracer::default();
    let mut map = VoxelSet::default();
    let mut earlier: VecDeque<VoxelSet> = VecDeque::new();
    for scan in scans {
        let mut trace = |insert_mode| {
            let config = config.clone().with_insert_mode(insert_mode);
            tracer.trace(&config.grid, &config.sensor_model, &config.rays, scan)
        };
        let updates = trace(InsertMode::PerRay)?;
        counts.updates += updates.tiles.iter().map(|(_, updates)| updates.len() as u64).sum::<u64>();
        let voxels = VoxelSet::of(&trace(InsertMode::PerScan)?);
        if earlier.len() == EARLIER_SCANS {
            let common = voxels.count_common(&earlier);
            counts.overlaps.push(common as f64 / voxels.len().max(1) as f64);
            earlier.pop_front();
        }
        counts.of_scans += voxels.len();
        map.extend(&voxels);
        earlier.push_back(voxels);
    }
    counts.of_map = map.len();
    Ok(counts)
}

/// Steps of the distribution of sorted samples.
fn distribution(sorted: &[f64]) -> Vec<[f64; 2]> {
    let share = |count: usize| count as f64 / sorted.len() as f64;
    sorted.iter().enumerate().flat_map(|(k, &x)| [[x, share(k)], [x, share(k + 1)]]).collect()
}

impl VoxelSet {
    /// The voxels of a scan with one update per voxel.
    fn of(updates: &ScanUpdates) -> Self {
        let mut set = Self::default();
        for (tile, updates) in &updates.tiles {
            let TileUpdates::Masks(bricks) = updates else { continue };
            for update in bricks {
                set.0.insert((*tile, update.brick), update.touched());
            }
        }
        set
    }

    fn len(&self) -> u64 {
        self.0.values().map(count_ones).sum()
    }

    fn extend(&mut self, other: &Self) {
        for (brick, mask) in &other.0 {
            let known = self.0.entry(*brick).or_default();
            (0..8).for_each(|word| known[word] |= mask[word]);
        }
    }

    /// Number of voxels that are in any of the others.
    fn count_common(&self, others: &VecDeque<Self>) -> u64 {
        let common = self.0.iter().map(|(brick, mask)| {
            let found = others.iter().filter_map(|other| other.0.get(brick));
            let any = found.fold([0; 8], |any: BrickMask, other| std::array::from_fn(|k| any[k] | other[k]));
            count_ones(&std::array::from_fn(|word| mask[word] & any[word]))
        });
        common.sum()
    }
}

fn count_ones(mask: &BrickMask) -> u64 {
    mask.iter().map(|word| u64::from(word.count_ones())).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dataset::datasets;
    use crate::update_stream::updates;
    use std::collections::BTreeSet;
    use std::path::Path;

    #[test]
    fn counts_match_a_count_of_single_voxels() {
        let config = map_config(0.4).unwrap();
        let scans = datasets(Path::new(""))[1].scans(4).unwrap();
        let counts = count(&config, &scans).unwrap();
        let voxels_of = |scans: &[Scan]| -> BTreeSet<_> {
            updates(&config.grid, scans, usize::MAX).iter().map(|update| update.voxel).collect()
        };
        assert_eq!(counts.updates, updates(&config.grid, &scans, usize::MAX).len() as u64);
        assert_eq!(counts.of_map, voxels_of(&scans).len() as u64);
        assert_eq!(counts.of_scans, scans.chunks(1).map(|scan| voxels_of(scan).len() as u64).sum::<u64>());
        let (before, last) = (voxels_of(&scans[..3]), voxels_of(&scans[3..]));
        let overlap = before.intersection(&last).count() as f64 / last.len() as f64;
        assert_eq!(counts.overlaps.sorted(), [overlap]);
    }

    #[test]
    fn a_distribution_rises_to_one() {
        assert_eq!(distribution(&[0.2, 0.7]), [[0.2, 0.0], [0.2, 0.5], [0.7, 0.5], [0.7, 1.0]]);
    }
}
