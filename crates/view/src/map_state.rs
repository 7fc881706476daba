use super::overview::overview;
use serde_json::json;
use std::sync::{Arc, OnceLock};
use voxtile::Result;
use voxtile::mapper::MapView;
use voxtile_pipeline::AnyMap;
use voxtile_render::classes::{class_color, class_name};
use voxtile_render::levels::{
    Difference, Kind, Levels, LevelsOf, NodeKey, NodeStore, TilesetContent, TilesetNodes, subtree, tileset,
};
use voxtile_render::{Layer, is_unix_time};

/// One state of a map: a flush or a snapshot.
pub struct MapState {
    pub map: AnyMap,
    pub levels: Levels,
    /// Coarse nodes of this and other states of the map.
    pub store: Arc<NodeStore>,
    /// Increases with each state that was shown.
    pub generation: u64,
    /// Number of tiles that are not in the coarse levels of detail yet.
    pub pending_tiles: u64,
    /// `overview.json`, once it was requested.
    pub overview: OnceLock<Overview>,
}

/// Answer of `overview.json`.
#[derive(Clone)]
pub struct Overview {
    value: serde_json::Value,
    /// Number of tiles of the map when it was computed.
    tiles: usize,
}

impl Overview {
    /// Returns whether it is good enough for a later state with this many tiles: a build that flushes often must not
    /// read tiles for each flush.
    fn suits(&self, tiles: usize) -> bool {
        tiles.abs_diff(self.tiles) * 4 <= self.tiles
    }
}

/// One state, or the changes between two.
pub enum Shown {
    State(Arc<MapState>),
    Change { before: Arc<MapState>, after: Arc<MapState> },
}

/// Map for queries that need no levels.
pub enum QueryMap {
    State(Arc<MapState>),
    Opened(AnyMap),
}

impl QueryMap {
    pub fn map(&self) -> &AnyMap {
        match self {
            Self::State(state) => &state.map,
            Self::Opened(map) => map,
        }
    }

    /// Returns `overview.json`.
    pub fn overview(&self) -> Result<serde_json::Value> {
        let computed = || {
            let tiles = self.map().tile_indices();
            Ok(Overview { value: overview(self.map(), &tiles, None)?, tiles: tiles.len() })
        };
        let Self::State(state) = self else { return computed().map(|computed| computed.value) };
        if let Some(known) = state.overview.get() {
            return Ok(known.value.clone());
        }
        let computed = computed()?;
        Ok(state.overview.get_or_init(|| computed).value.clone())
    }
}

impl Shown {
    /// Returns the state for queries.
    pub fn state(&self) -> &MapState {
        match self {
            Self::State(state) | Self::Change { after: state, .. } => state,
        }
    }

    pub fn tileset(&self) -> Result<serde_json::Value> {
        let extras = serde_json::json!({ "generation": self.state().generation });
        let content = TilesetContent::Voxels;
        match self {
            Self::State(state) => tileset(&state.nodes(), &state.store, content, extras),
            Self::Change { before, after } => {
                tileset(&difference(before, after)?, &after.store, content, extras)
            }
        }
    }

    pub fn subtree(&self, key: NodeKey) -> Result<Option<serde_json::Value>> {
        let content = TilesetContent::Voxels;
        match self {
            Self::State(state) => subtree(&state.nodes(), &state.store, content, key),
            Self::Change { before, after } => {
                subtree(&difference(before, after)?, &after.store, content, key)
            }
        }
    }

    /// Returns the version of a node, or of the tile that contains it.
    pub fn version(&self, key: NodeKey) -> Result<Option<u64>> {
        match self {
            Self::State(state) => Ok(state.nodes().version_of(key)),
            Self::Change { before, after } => Ok(difference(before, after)?.version_of(key)),
        }
    }

    /// Returns the compressed bytes of a node with the values of a layer. Changes have none.
    pub fn layered_node(&self, key: NodeKey, layer: Layer) -> Result<Option<Vec<u8>>> {
        match self {
            Self::State(state) => state.levels.layered_node(&state.map, &state.store, key, layer),
            Self::Change { .. } => self.node(key, Kind::Occupied),
        }
    }

    /// Returns the compressed bytes of a node.
    pub fn node(&self, key: NodeKey, kind: Kind) -> Result<Option<Vec<u8>>> {
        match self {
            Self::State(state) => state.levels.node(&state.map, &state.store, key, kind),
            Self::Change { before, after } => difference(before, after)?.node(&after.store, key),
        }
    }
}

fn difference<'a>(before: &'a MapState, after: &'a MapState) -> Result<Difference<'a, AnyMap>> {
    Difference::new((&before.levels, &before.map), (&after.levels, &after.map))
}

impl MapState {
    /// Returns the overview of a later state with this many tiles, if the one of this state suits it.
    pub fn overview_for(&self, tiles: usize) -> OnceLock<Overview> {
        let known = self.overview.get().filter(|known| known.suits(tiles));
        known.map_or_else(OnceLock::new, |known| OnceLock::from(known.clone()))
    }

    /// Returns `layers.json`.
    pub fn layer_legends(&self) -> Result<serde_json::Value> {
        layer_legends(&self.levels, &self.map, &self.store)
    }

    pub fn nodes(&self) -> LevelsOf<'_, AnyMap> {
        LevelsOf { levels: &self.levels, map: &self.map }
    }
}

/// Returns `layers.json`: what legends show of the layers of all occupied voxels.
pub fn layer_legends(levels: &Levels, map: &AnyMap, store: &NodeStore) -> Result<serde_json::Value> {
    let totals = levels.layer_totals(map, store)?;
    let layers = map.config().layers();
    let mut legends = serde_json::Map::new();
    if layers.colour {
        legends.insert("colour".into(), json!({}));
    }
    if layers.intensity_max.is_some() {
        legends.insert("intensity".into(), json!({ "range": totals.intensity_range(&layers) }));
    }
    if layers.class {
        let class = |(class, voxels)| {
            let (name, color) = (class_name(class), class_color(class));
            json!({ "class": class, "name": name, "color": color, "voxels": voxels })
        };
        legends.insert("class".into(), json!({ "classes": totals.classes().map(class).collect::<Vec<_>>() }));
    }
    if layers.time {
        let range_s = totals.time().map(|time| [time.first_ns, time.last_ns].map(|ns| ns as f64 * 1e-9));
        let is_unix = range_s.is_some_and(|range| range.into_iter().all(is_unix_time));
        legends.insert("time".into(), json!({ "range_s": range_s, "is_unix_time": is_unix }));
    }
    Ok(legends.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_overview_is_renewed_when_the_map_has_grown_by_a_quarter() {
        let of = |tiles| Overview { value: serde_json::Value::Null, tiles };
        assert_eq!([99, 100, 125, 126].map(|tiles| of(100).suits(tiles)), [true, true, true, false]);
        assert!(!of(100).suits(74));
        assert!(of(0).suits(0) && !of(0).suits(1));
    }
}
