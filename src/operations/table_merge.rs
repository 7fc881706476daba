use super::merge_rule::MergeRule;
use crate::sensor::Evidence;
use crate::space::{BRICK_VOXELS, BrickCode, BrickMask, MortonCode, add_to_mask, is_in_mask, places};
use crate::tile::{LayerTable, Table};
use std::collections::BTreeSet;

/// Merges the tables of a tile in several maps. Its buffers are reused: 8 KiB per map.
#[derive(Debug)]
pub(super) struct TableMerge {
    rule: MergeRule,
    /// Current brick in each map.
    bricks: Vec<MapBrick>,
    /// Evidence of the current voxel.
    known: Vec<Evidence>,
    run: Vec<(usize, Evidence)>,
    /// Number of voxels so far that are in two or more maps.
    pub(super) common: u64,
}

#[derive(Clone, Debug)]
struct MapBrick {
    observed: BrickMask,
    evidence: Vec<Evidence>,
}

impl TableMerge {
    pub(super) fn new(rule: MergeRule) -> Self {
        Self { rule, bricks: Vec::new(), known: Vec::new(), run: Vec::new(), common: 0 }
    }

    /// Merges the tables, which are in the order of their maps.
    pub(super) fn merge(&mut self, tables: &[&Table]) -> Table {
        let unused = MapBrick { observed: [0; 8], evidence: vec![Evidence::PRIOR; BRICK_VOXELS] };
        self.bricks.resize(tables.len().max(self.bricks.len()), unused);
        let codes: BTreeSet<BrickCode> = tables.iter().flat_map(|table| table.bricks()).collect();
        let mut merged = Table::default();
        for code in codes {
            self.merge_brick(code, tables);
            merged.insert(code, &self.run);
        }
        merged.set_layers(self.merged_layers(tables));
        merged
    }

    /// Layers of a voxel are combined as its evidence: added, or taken from the map whose evidence is taken.
    fn merged_layers(&self, tables: &[&Table]) -> Option<LayerTable> {
        let layers = tables.iter().find_map(|table| table.layers())?.layers();
        let mut merged = LayerTable::new(layers);
        for (number, table) in tables.iter().enumerate() {
            let Some(layers) = table.layers() else { continue };
            match self.rule {
                MergeRule::Add { .. } => merged.merge(layers),
                MergeRule::Take(_) => {
                    merged.merge(&layers.filtered(|voxel| self.map_of(tables, voxel) == Some(number)));
                }
            }
        }
        Some(merged)
    }

    /// Number of the map whose evidence of a voxel is taken.
    fn map_of(&self, tables: &[&Table], voxel: MortonCode) -> Option<usize> {
        let known = tables.iter().enumerate().filter_map(|(number, table)| Some((number, table.get(voxel)?)));
        let (numbers, known): (Vec<usize>, Vec<Evidence>) = known.unzip();
        numbers.get(self.rule.chosen(&known)?).copied()
    }

    fn merge_brick(&mut self, code: BrickCode, tables: &[&Table]) {
        let Self { rule, bricks, known, run, common } = self;
        let bricks = &mut bricks[..tables.len()];
        let mut observed = [0; 8];
        for (brick, table) in bricks.iter_mut().zip(tables) {
            let MapBrick { observed: own, evidence } = brick;
            *own = [0; 8];
            table.for_each_in(code, |place, now| {
                add_to_mask(own, place);
                evidence[place] = now;
            });
            (0..8).for_each(|word| observed[word] |= own[word]);
        }
        run.clear();
        for place in places(observed) {
            known.clear();
            let knows = |brick: &&MapBrick| is_in_mask(&brick.observed, place);
            known.extend(bricks.iter().filter(knows).map(|brick| brick.evidence[place]));
            *common += u64::from(known.len() > 1);
            run.extend(rule.evidence(known).map(|evidence| (place, evidence)));
        }
    }
}
