use std::sync::Arc;
use voxtile::Result;
use voxtile_pipeline::AnyMap;
use voxtile_render::levels::{
    Difference, Kind, Levels, LevelsOf, NodeKey, NodeStore, TilesetContent, TilesetNodes, subtree, tileset,
};

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
    pub fn nodes(&self) -> LevelsOf<'_, AnyMap> {
        LevelsOf { levels: &self.levels, map: &self.map }
    }
}
