use super::las_points::LasPoint;
use crate::spill::Record;
use std::cmp::Ordering;

impl Record for LasPoint {
    const BYTES: usize = 34;

    fn encode(&self, bytes: &mut [u8]) {
        let [x, y, z] = self.position_m;
        let numbers = [self.time_s, x, y, z].into_iter().flat_map(f64::to_le_bytes);
        for (to, from) in bytes.iter_mut().zip(numbers.chain(self.intensity.to_le_bytes())) {
            *to = from;
        }
    }

    fn decode(bytes: &[u8]) -> Self {
        let (numbers, rest) = bytes.as_chunks::<8>();
        let double = |k: usize| numbers.get(k).copied().map_or(0.0, f64::from_le_bytes);
        Self {
            time_s: double(0),
            position_m: [double(1), double(2), double(3)],
            intensity: rest.first_chunk().copied().map_or(0, u16::from_le_bytes),
        }
    }

    fn order(&self, other: &Self) -> Ordering {
        self.time_s.total_cmp(&other.time_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spill::{Budget, Sorter};

    #[test]
    fn many_runs_and_one_give_the_same_stable_order() {
        let points: Vec<LasPoint> = (0..5000_u32)
            .map(|k| LasPoint {
                position_m: [f64::from(k), -1.5, 1e6 + 0.001],
                intensity: (k % 65_536) as u16,
                time_s: f64::from(k.wrapping_mul(2_654_435_761) >> 22) * 0.25,
            })
            .collect();
        let mut wanted = points.clone();
        wanted.sort_by(|a, b| a.time_s.total_cmp(&b.time_s));
        for memory_bytes in [0, 40 * 100, 1 << 20] {
            let mut sorter = Sorter::new(&Budget::default(), memory_bytes);
            for point in &points {
                sorter.push(*point).unwrap();
            }
            assert_eq!(sorter.is_in_file(), memory_bytes < 1 << 20);
            let mut sorted = sorter.finish().unwrap();
            let mut found = Vec::new();
            while let Some(point) = sorted.next().unwrap() {
                found.push(point);
            }
            assert_eq!(found, wanted, "{memory_bytes}");
        }
    }
}
