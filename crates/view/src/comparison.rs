use super::node_cache;
use super::response::{Answer, Keep};
use super::route::Thing;
use crate::view::Progress;
use anyhow::Context;
use serde_json::{Value, json};
use std::path::Path;
use voxtile::Result;
use voxtile::mapper::MapView;
use voxtile_compare::{CompareOptions, Comparison, VoxelClass, compare, for_each_voxel};
use voxtile_pipeline::{check_crs, open_any_map, viewpoints_of, warnings_of};
use voxtile_render::levels::{
    ComparedLevels, ComparedLevelsBuilder, Kind, TilesetContent, TilesetNodes, class_bit, subtree, tileset,
};

/// Comparison of the first map with the second, as they were when the server started.
pub struct ServedComparison {
    levels: ComparedLevels,
    comparison: Comparison,
    warnings: Vec<String>,
}

/// Maximum number of changes in `changes.json`.
const MAX_CHANGES: usize = 1000;

impl ServedComparison {
    /// Compares two maps, in two passes over both. `progress` receives the blocks done and in total, twice.
    ///
    /// # Errors
    ///
    /// Fails if the maps cannot be compared, a tile cannot be read, or the temporary file cannot be written.
    pub fn of(paths: [&Path; 2], options: &CompareOptions, progress: &Progress) -> anyhow::Result<Self> {
        let open =
            |path: &Path| open_any_map(path).with_context(|| format!("cannot show {}", path.display()));
        let (before, after) = (open(paths[0])?, open(paths[1])?);
        let maps = [(paths[0], &before), (paths[1], &after)];
        check_crs(maps)?;
        let warnings = warnings_of(maps);
        warnings.iter().for_each(|warning| log::warn!("{warning}"));
        let step = |done, all| progress(done, all);
        let viewpoints = [viewpoints_of(&before, None)?, viewpoints_of(&after, None)?];
        let options = &options.clone().with_viewpoints(viewpoints);
        let comparison = compare(&before, &after, options, &step)?;
        let mut builder = ComparedLevelsBuilder::new(after.config().grid, node_cache::temporary()?);
        let classes = &VoxelClass::ALL;
        let add = |voxel: voxtile_compare::ComparedVoxel| builder.add(voxel.index, voxel.class);
        for_each_voxel(&before, &after, options, &comparison, classes, add, &step)?;
        Ok(Self { levels: builder.finish()?, comparison, warnings })
    }

    /// Returns the description in `maps.json`. The maps are the first and the second one.
    pub fn describe(&self) -> Value {
        let Comparison { before, after, .. } = &self.comparison;
        // By their bits in the nodes; those of hidden voxels of both maps are one.
        let mut classes: Vec<(&str, u64)> = Vec::new();
        for class in VoxelClass::ALL {
            let voxels = self.comparison.voxels_of(class);
            match classes.get_mut(usize::from(class_bit(class))) {
                Some((_, all)) => *all += voxels,
                None if class == VoxelClass::HiddenBefore => classes.push(("hidden", voxels)),
                None => classes.push((class.name(), voxels)),
            }
        }
        if before.hidden.or(after.hidden).is_none() {
            classes.retain(|(name, _)| *name != "hidden");
        }
        let classes: Vec<Value> =
            classes.into_iter().map(|(name, voxels)| json!({ "name": name, "voxels": voxels })).collect();
        json!({ "before": 0, "after": 1, "classes": classes, "warnings": self.warnings })
    }

    /// Responds from the levels; `None` if there is no such node.
    pub fn answer(&self, thing: &Thing, version: Option<u64>) -> Result<Option<Answer>> {
        let (levels, store, content) = (&self.levels, self.levels.store(), TilesetContent::Voxels);
        let keep = |key| {
            let is_current = version.is_some() && levels.version_of(key) == version;
            if is_current { Keep::ForEver } else { Keep::No }
        };
        Ok(match thing {
            // The comparison never changes.
            Thing::Tileset => {
                Some(Answer::json(tileset(levels, store, content, json!({ "generation": 1 }))?))
            }
            Thing::Subtree(key) => subtree(levels, store, content, *key)?
                .map(|value| Answer { keep: keep(*key), ..Answer::json(value) }),
            Thing::Node(key, Kind::Occupied) | Thing::LayeredNode(key, _) => {
                levels.node(*key)?.map(|bytes| Answer::bytes(bytes, keep(*key)))
            }
            Thing::Changes => Some(Answer::json(self.changes())),
            _ => None,
        })
    }

    fn changes(&self) -> Value {
        let all = &self.comparison.changes;
        json!({ "changes": &all[..all.len().min(MAX_CHANGES)], "all": all.len() })
    }
}
