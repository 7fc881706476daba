use super::layer_sums::{Reader, put};
use std::collections::BTreeMap;
use voxtile::{Layers, TimeSpan, VoxelLayers};

/// Layers of all occupied voxels below some nodes, for legends. Voxels that no point hit do not count.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LayerTotals {
    /// Number of voxels by class.
    classes: BTreeMap<u8, u64>,
    /// Number of voxels by mean intensity, in bins ([`bin_of`]).
    intensities: BTreeMap<u16, u64>,
    time: Option<TimeSpan>,
}

/// Significant bits of the intensity of a bin.
const BIN_BITS: u32 = 10;

/// Returns the bin of a stored intensity: the middle of all intensities with the same highest bits.
fn bin_of(stored: u64) -> u16 {
    let stored = stored.min(u64::from(u16::MAX)) as u16;
    let shift = (u16::BITS - stored.leading_zeros()).saturating_sub(BIN_BITS);
    (stored >> shift << shift) + (1 << shift) / 2
}

impl LayerTotals {
    pub(super) fn add_voxel(&mut self, voxel: &VoxelLayers) {
        if let Some(class) = voxel.class() {
            *self.classes.entry(class).or_default() += 1;
        }
        if let Some(mean) = voxel.intensity.sum.checked_div(voxel.intensity.points) {
            *self.intensities.entry(bin_of(mean)).or_default() += 1;
        }
        self.add_time(voxel.time);
    }

    pub(super) fn add(&mut self, other: &Self) {
        other.classes.iter().for_each(|(class, count)| *self.classes.entry(*class).or_default() += count);
        let intensities = &mut self.intensities;
        other.intensities.iter().for_each(|(bin, count)| *intensities.entry(*bin).or_default() += count);
        self.add_time(other.time);
    }

    fn add_time(&mut self, time: Option<TimeSpan>) {
        let Some(time) = time else { return };
        let all = self.time.get_or_insert(time);
        all.first_ns = all.first_ns.min(time.first_ns);
        all.last_ns = all.last_ns.max(time.last_ns);
    }

    /// Returns the number of voxels of each class, in ascending order.
    pub fn classes(&self) -> impl Iterator<Item = (u8, u64)> {
        self.classes.iter().map(|(class, count)| (*class, *count))
    }

    /// Returns the mean intensities of voxels at the 2nd and the 98th percentile, in the unit of the points and to
    /// within 0.1 %.
    pub fn intensity_range(&self, layers: &Layers) -> Option<[f64; 2]> {
        let all: u64 = self.intensities.values().sum();
        let max = layers.intensity_max.filter(|_| all > 0)?;
        let at = |number: u64| {
            let mut before = 0;
            let mut bins = self.intensities.iter();
            let bin = bins.find(|(_, count)| {
                before += **count;
                before > number
            });
            bin.map_or(0.0, |(bin, _)| f64::from(*bin) / f64::from(u16::MAX) * f64::from(max))
        };
        Some([at(all / 50), at(all - 1 - all / 50)])
    }

    /// Returns the times of the first and the last hit; `None` without time stamps.
    pub fn time(&self) -> Option<TimeSpan> {
        self.time
    }

    pub(super) fn put(&self, bytes: &mut Vec<u8>) {
        put(bytes, self.classes.len() as u64);
        for (class, count) in &self.classes {
            bytes.push(*class);
            put(bytes, *count);
        }
        put(bytes, self.intensities.len() as u64);
        for (bin, count) in &self.intensities {
            put(bytes, u64::from(*bin));
            put(bytes, *count);
        }
        bytes.push(u8::from(self.time.is_some()));
        for ns in self.time.into_iter().flat_map(|time| [time.first_ns, time.last_ns]) {
            put(bytes, ns);
        }
    }

    pub(super) fn read(reader: &mut Reader<'_>) -> Option<Self> {
        let mut totals = Self::default();
        for _ in 0..reader.number::<u64>()? {
            totals.classes.insert(reader.byte()?, reader.number()?);
        }
        for _ in 0..reader.number::<u64>()? {
            totals.intensities.insert(u16::try_from(reader.number::<u64>()?).ok()?, reader.number()?);
        }
        if reader.byte()? > 0 {
            totals.time = Some(TimeSpan { first_ns: reader.number()?, last_ns: reader.number()? });
        }
        Some(totals)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_keep_ten_bits() {
        let bins = [0, 7, 1023, 1024, 1025, 2050, 65535, 1 << 40].map(bin_of);
        assert_eq!(bins, [0, 7, 1023, 1025, 1025, 2050, 0xffe0, 0xffe0]);
    }

    #[test]
    fn ranges_are_percentiles() {
        let mut totals = LayerTotals::default();
        for intensity in 0..100 {
            let mut voxel = VoxelLayers::default();
            (voxel.intensity.points, voxel.intensity.sum) = (2, 2 * intensity);
            totals.add_voxel(&voxel);
        }
        let layers = Layers { intensity_max: Some(65535.0), ..Layers::NONE };
        assert_eq!(totals.intensity_range(&layers), Some([2.0, 97.0]));
        assert_eq!(totals.intensity_range(&Layers::NONE), None);
        assert_eq!(LayerTotals::default().intensity_range(&layers), None);
    }
}
