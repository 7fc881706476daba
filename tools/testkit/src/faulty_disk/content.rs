use crate::random_scans::Random;

/// The bytes of a file: as programs see them, and as they are on the medium.
#[derive(Clone, Debug, Default)]
pub(super) struct Content {
    pub(super) seen: Vec<u8>,
    pub(super) on_medium: Vec<u8>,
    /// Whether `seen` counts as synced although it never reached the medium.
    pub(super) lost: bool,
    pub(super) readers: usize,
    pub(super) locked: bool,
}

impl Content {
    /// Content after a crash: a random mix of old and unsynced blocks, of the old or the new length.
    pub(super) fn mixed(&self, random: &mut Random) -> Vec<u8> {
        const BLOCK: usize = 512;
        let (old, new) = (&self.on_medium, &self.seen);
        match random.below(3) {
            0 => return old.clone(),
            1 => return new.clone(),
            _ => {}
        }
        let length = if random.below(2) == 0 { old.len() } else { new.len() };
        let mut bytes = old.clone();
        bytes.resize(length, 0);
        for start in (0..length.min(new.len())).step_by(BLOCK) {
            let end = (start + BLOCK).min(length).min(new.len());
            if random.below(2) == 0 {
                bytes[start..end].copy_from_slice(&new[start..end]);
            }
        }
        bytes
    }
}
