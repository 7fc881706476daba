use crate::bits::Bits;
use crate::extent::Extent;
use crate::options::{DistanceOptions, UnknownRule};
use crate::transform::Rows;

/// Which voxels of a box were observed and which are occupied.
#[derive(Clone, Debug)]
pub(crate) struct Observed {
    pub(crate) occupied: Bits,
    /// `None` if the field does not depend on it.
    pub(crate) known: Option<Bits>,
}

impl Observed {
    pub(crate) fn new(extent: Extent, options: &DistanceOptions) -> Self {
        Self { occupied: Bits::new(extent), known: options.needs_known().then(|| Bits::new(extent)) }
    }

    pub(crate) fn extent(&self) -> Extent {
        self.occupied.extent()
    }

    /// Makes all voxels unknown.
    pub(crate) fn clear(&mut self) {
        self.occupied.clear();
        self.known.iter_mut().for_each(Bits::clear);
    }

    /// Bytes of memory for a box.
    pub(crate) fn bytes_of(size: [usize; 3], options: &DistanceOptions) -> usize {
        Bits::bytes_of(size) * if options.needs_known() { 2 } else { 1 }
    }

    /// The voxels that are obstacles.
    pub(crate) fn obstacles(&self, rule: UnknownRule) -> impl Rows {
        move |y: usize, z: usize, row: &mut [u64]| {
            row.copy_from_slice(self.occupied.row(y, z));
            if rule == UnknownRule::Obstacle
                && let Some(known) = &self.known
            {
                row.iter_mut().zip(known.row(y, z)).for_each(|(word, known)| *word |= !known);
                self.mask_end(row);
            }
        }
    }

    /// The voxels to which distances inside obstacles are measured: free ones, and unknown ones if they are free.
    pub(crate) fn open(&self) -> impl Rows {
        move |y: usize, z: usize, row: &mut [u64]| {
            let occupied = self.occupied.row(y, z);
            match &self.known {
                Some(known) => row
                    .iter_mut()
                    .zip(known.row(y, z).iter().zip(occupied))
                    .for_each(|(word, (known, occupied))| *word = known & !occupied),
                None => row.iter_mut().zip(occupied).for_each(|(word, occupied)| *word = !occupied),
            }
            self.mask_end(row);
        }
    }

    /// Clears the bits beyond the end of a row.
    fn mask_end(&self, row: &mut [u64]) {
        let bits = self.extent().size[0] % 64;
        if bits > 0
            && let Some(last) = row.last_mut()
        {
            *last &= (1 << bits) - 1;
        }
    }
}
