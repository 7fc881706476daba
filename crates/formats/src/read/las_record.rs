use super::las_points::LasPoint;
use crate::spill::Record;
use std::cmp::Ordering;

/// A point to sort. It takes `BYTES` bytes in a file; those beyond are dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LasRecord<const BYTES: usize>(pub(super) LasPoint);

/// Size of a point without attributes.
pub(super) const PLAIN_BYTES: usize = 34;
/// Size of a point with its colour and its class.
pub(super) const ATTRIBUTED_BYTES: usize = PLAIN_BYTES + 4;

impl<const BYTES: usize> Record for LasRecord<BYTES> {
    const BYTES: usize = BYTES;

    fn encode(&self, bytes: &mut [u8]) {
        let LasPoint { position_m: [x, y, z], intensity, time_s, colour, class } = self.0;
        let numbers = [time_s, x, y, z].into_iter().flat_map(f64::to_le_bytes);
        let numbers = numbers.chain(intensity.to_le_bytes()).chain(colour).chain([class]);
        for (to, from) in bytes.iter_mut().zip(numbers) {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (numbers, _) = bytes.as_chunks::<8>();
        let double = |k: usize| numbers.get(k).copied().map_or(0.0, f64::from_le_bytes);
        let rest = bytes.get(4 * size_of::<f64>()..).unwrap_or_default();
        let byte = |at: usize| rest.get(at).copied().unwrap_or(0);
        Self(LasPoint {
            time_s: double(0),
            position_m: [double(1), double(2), double(3)],
            intensity: u16::from_le_bytes([byte(0), byte(1)]),
            colour: [byte(2), byte(3), byte(4)],
            class: byte(5),
        })
    }

    fn order(&self, other: &Self) -> Ordering {
        self.0.time_s.total_cmp(&other.0.time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::{Budget, Sorter};

    #[test]
    fn many_runs_and_one_give_the_same_stable_order() {
        let mut points: Vec<LasPoint> = (0..5000_u32)
            .map(|k| LasPoint {
                colour: [k as u8, (k >> 8) as u8, 7],
                class: (k % 256) as u8,
                position_m: [f64::from(k), -1.5, 1e6 + 0.001],
                intensity: (k % 65_536) as u16,
                time_s: f64::from(k.wrapping_mul(2_654_435_761) >> 22) * 0.25,
            })
            .collect();
        let mut wanted = points.clone();
        wanted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        assert_sorted::<ATTRIBUTED_BYTES>(&points, &wanted);
        for point in points.iter_mut().chain(&mut wanted) {
            (point.colour, point.class) = ([0; 3], 0);
        }
        assert_sorted::<PLAIN_BYTES>(&points, &wanted);
    }

    fn assert_sorted<const BYTES: usize>(points: &[LasPoint], wanted: &[LasPoint]) {
        for memory_bytes in [0, 40 * 100, 1 << 20] {
            let mut sorter = Sorter::new(&Budget::default(), memory_bytes);
            for point in points {
                sorter.push(LasRecord::<BYTES>(*point)).unwrap();
            }
            assert_eq!(sorter.is_in_file(), memory_bytes < 1 << 20);
            let mut sorted = sorter.finish().unwrap();
            let mut found = Vec::new();
            while let Some(point) = sorted.next().unwrap() {
                found.push(point.0);
            }
            assert_eq!(found, wanted, "{memory_bytes}");
        }
    }
}
