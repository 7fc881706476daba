use crate::config::Layers;
use crate::scan::LayerHit;

/// Sums over points of a scan in one voxel and of one class.
///
/// 64 bits suffice: the largest terms, squares of intensities, have 32.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct HitRun {
    pub(super) points: u64,
    /// Points without a colour.
    pub(super) uncoloured: u64,
    pub(super) colour: [u64; 3],
    /// Points without an intensity.
    pub(super) unmeasured: u64,
    pub(super) intensity: u64,
    /// Sum of the squares of the intensities.
    pub(super) squares: u64,
    pub(super) class: Option<u8>,
    pub(super) offsets: [i64; 3],
    /// Sums of the products xx, yy, zz, xy, xz and yz of the offsets.
    pub(super) products: [i64; 6],
}

impl HitRun {
    /// Sums up the layers of hits of the same voxel and class.
    #[inline]
    pub(super) fn of(hits: &[LayerHit], layers: &Layers) -> Self {
        let mut run = Self {
            points: hits.len() as u64,
            class: hits.first().and_then(|hit| hit.class),
            ..Self::default()
        };
        if layers.colour {
            for hit in hits {
                match hit.colour {
                    Some(colour) => (0..3).for_each(|k| run.colour[k] += u64::from(colour[k])),
                    None => run.uncoloured += 1,
                }
            }
        }
        if layers.intensity_max.is_some() {
            for hit in hits {
                match hit.intensity.map(u64::from) {
                    Some(intensity) => {
                        run.intensity += intensity;
                        run.squares += intensity * intensity;
                    }
                    None => run.unmeasured += 1,
                }
            }
        }
        if layers.shape {
            for hit in hits {
                let [x, y, z] = hit.offset.map(i64::from);
                let add = |sums: &mut [i64], terms: &[i64]| {
                    sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                };
                add(&mut run.offsets, &[x, y, z]);
                add(&mut run.products, &[x * x, y * y, z * z, x * y, x * z, y * z]);
            }
        }
        run
    }
}
