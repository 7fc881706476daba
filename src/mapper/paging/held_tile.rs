use crate::persistence::CompactTile;
use crate::space::TileIndex;
use crate::tile::Tile;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A resident tile that a flush beside the mapper is to write. Until that begins, the mapper may leave it the compact
/// form instead: then the tile itself can leave memory.
#[derive(Debug)]
pub(super) struct HeldTile {
    index: TileIndex,
    held: Mutex<Held>,
}

#[derive(Debug)]
struct Held {
    form: HeldForm,
    is_being_written: bool,
}

/// What of a tile is held.
#[derive(Clone, Debug)]
pub(super) enum HeldForm {
    Resident(Arc<Tile>),
    Compact(CompactTile),
}

impl HeldTile {
    pub(super) fn new(tile: Arc<Tile>) -> Self {
        let index = tile.index();
        let held = Held { form: HeldForm::Resident(tile), is_being_written: false };
        Self { index, held: Mutex::new(held) }
    }

    pub(super) fn index(&self) -> TileIndex {
        self.index
    }

    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        match &self.lock().form {
            HeldForm::Resident(tile) => tile.bytes(),
            HeldForm::Compact(tile) => tile.bytes().len(),
        }
    }

    /// The tile, unless it has the compact form.
    pub(super) fn resident(&self) -> Option<Arc<Tile>> {
        match &self.lock().form {
            HeldForm::Resident(tile) => Some(tile.clone()),
            HeldForm::Compact(_) => None,
        }
    }

    /// Holds a copy instead; `false` if it has the compact form by now.
    pub(super) fn hold_copy(&self, copy: Tile) -> bool {
        let mut held = self.lock();
        let is_resident = matches!(held.form, HeldForm::Resident(_));
        if is_resident {
            held.form = HeldForm::Resident(Arc::new(copy));
        }
        is_resident
    }

    /// Whether it may have the compact form from now on.
    pub(super) fn may_be_packed(&self) -> bool {
        !self.lock().is_being_written
    }

    /// Holds the compact form instead; `false` if the tile is being written.
    pub(super) fn hold_packed(&self, packed: CompactTile) -> bool {
        let mut held = self.lock();
        if !held.is_being_written {
            held.form = HeldForm::Compact(packed);
        }
        !held.is_being_written
    }

    /// What is to be written, which stays from now on.
    pub(super) fn begin_write(&self) -> HeldForm {
        let mut held = self.lock();
        held.is_being_written = true;
        held.form.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
