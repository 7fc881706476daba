use crate::persistence::CompactTile;
use crate::space::TileIndex;
use crate::tile::Tile;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Resident tile that a background flush will write. Until the write begins, the mapper may replace it by its compact
/// form and evict the tile.
#[derive(Debug)]
pub(super) struct PinnedTile {
    index: TileIndex,
    held: Mutex<Held>,
}

#[derive(Debug)]
struct Held {
    form: PinnedForm,
    is_being_written: bool,
}

#[derive(Clone, Debug)]
pub(super) enum PinnedForm {
    Resident(Arc<Tile>),
    Compact(CompactTile),
}

impl PinnedTile {
    pub(super) fn new(tile: Arc<Tile>) -> Self {
        let index = tile.index();
        let held = Held { form: PinnedForm::Resident(tile), is_being_written: false };
        Self { index, held: Mutex::new(held) }
    }

    pub(super) fn index(&self) -> TileIndex {
        self.index
    }

    pub(super) fn bytes(&self) -> usize {
        match &self.lock().form {
            PinnedForm::Resident(tile) => tile.bytes(),
            PinnedForm::Compact(tile) => tile.bytes().len(),
        }
    }

    /// The tile, unless only its compact form is held.
    pub(super) fn resident(&self) -> Option<Arc<Tile>> {
        match &self.lock().form {
            PinnedForm::Resident(tile) => Some(tile.clone()),
            PinnedForm::Compact(_) => None,
        }
    }

    /// Replaces the tile by a copy; returns `false` if only the compact form is held.
    pub(super) fn hold_copy(&self, copy: Tile) -> bool {
        let mut held = self.lock();
        let is_resident = matches!(held.form, PinnedForm::Resident(_));
        if is_resident {
            held.form = PinnedForm::Resident(Arc::new(copy));
        }
        is_resident
    }

    /// Returns whether the tile may still be replaced by its compact form.
    pub(super) fn may_be_packed(&self) -> bool {
        !self.lock().is_being_written
    }

    /// Replaces the tile by its compact form; returns `false` if the tile is being written.
    pub(super) fn hold_packed(&self, packed: CompactTile) -> bool {
        let mut held = self.lock();
        if !held.is_being_written {
            held.form = PinnedForm::Compact(packed);
        }
        !held.is_being_written
    }

    /// Returns the form to write. From now on it cannot be replaced.
    pub(super) fn begin_write(&self) -> PinnedForm {
        let mut held = self.lock();
        held.is_being_written = true;
        held.form.clone()
    }

    fn lock(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
