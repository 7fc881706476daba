use super::samples::{Frame, Sample, Samples};

/// Brightness of the surfaces of an image: by face, darker behind steps in depth and at the rims of cubes.
pub struct Shade {
    /// Brightness of the faces across x, y, and z, and of small voxels.
    faces: [f64; 4],
    /// Distances of the compared samples.
    radii: [usize; 2],
}

const TOP: f64 = 1.06;
const SMALL: f64 = 1.0;
/// Brightness of a face to the left and to the right.
const SIDES: [f64; 2] = [0.9, 0.72];
const RIM: f64 = 0.78;
/// A step in depth of this many times the distance of the samples is as dark as possible.
const FULL_STEP: f64 = 5.0;
/// Darkness of full steps at small and large distances.
const STRENGTHS: [f64; 2] = [0.22, 0.16];
/// Directions to pairs of compared samples.
const PAIRS: [[i64; 2]; 4] = [[1, 0], [0, 1], [1, 1], [1, -1]];

impl Shade {
    /// Returns the shades for a distance of samples that is as wide as a line.
    pub fn new(frame: &Frame, radius: usize) -> Self {
        let side = |k: usize| {
            // To the right in the image is the side whose normal points to the right.
            let to_right = frame.camera.right[k] * frame.camera.near[k].signum();
            SIDES[0] + 0.5 * (1.0 + to_right) * (SIDES[1] - SIDES[0])
        };
        let faces = [side(0), side(1), TOP, SMALL];
        Self { faces, radii: [radius.max(1), 6 * radius.max(1)] }
    }

    /// Returns the brightness of a sample.
    pub fn light(&self, samples: &Samples, [x, y]: [usize; 2], sample: &Sample) -> f64 {
        let mut darkness = 0.0;
        for (radius, strength) in self.radii.into_iter().zip(STRENGTHS) {
            // Surroundings without a voxel are far away.
            let near = |step: [i64; 2], sign: i64| {
                let at = |from: usize, k: usize| {
                    from.checked_add_signed((sign * step[k] * radius as i64) as isize)
                };
                let other = at(x, 0).zip(at(y, 1)).and_then(|(x, y)| samples.at(x, y));
                other.map_or(f64::NEG_INFINITY, |other| other.near)
            };
            for step in PAIRS {
                // The mean of opposite samples is that of planes.
                let rise = 0.5 * (near(step, 1) + near(step, -1)) - sample.near;
                darkness += strength * (rise / (FULL_STEP * radius as f64)).clamp(0.0, 1.0);
            }
        }
        let rim = if sample.surface.is_rim { RIM } else { 1.0 };
        let face = self.faces[usize::from(sample.surface.face)];
        face * rim * (-darkness).exp()
    }
}

#[cfg(test)]
mod tests {
    use super::super::camera::Camera;
    use super::*;

    #[test]
    fn only_surfaces_behind_others_are_darkened() {
        let camera = Camera::new(-90.0, 90.0);
        let frame = Frame {
            camera,
            base: [0; 3],
            corner: [0.0, 30.0],
            scale: 1.0,
            size: [30; 2],
            depth: [0.0, 100.0],
            rim: 0.0,
        };
        let samples = Samples::new(frame);
        for x in 0..30 {
            for y in 0..30 {
                let z = if x < 15 { 20 } else { 0 };
                samples.add([x, y, z], || 0);
            }
        }
        let shade = Shade::new(&frame, 1);
        let light = |x: usize| shade.light(&samples, [x, 12], &samples.at(x, 12).unwrap());
        assert_eq!([light(8), light(14), light(28)], [TOP; 3]);
        assert!(
            light(15) < 0.7 * TOP && light(15) < light(17) && light(17) < TOP,
            "{} {}",
            light(15),
            light(17)
        );
    }

    #[test]
    fn planes_in_any_direction_have_no_shade() {
        let camera = Camera::new(-50.0, 30.0);
        let frame = Frame {
            camera,
            base: [0; 3],
            corner: [-40.0, 40.0],
            scale: 9.0,
            size: [720; 2],
            depth: [-99.0, 99.0],
            rim: 0.0,
        };
        let samples = Samples::new(frame);
        for x in -9..9 {
            for z in -9..9 {
                samples.add([x, 0, z], || 0);
            }
        }
        let shade = Shade::new(&frame, 1);
        let inner: Vec<f64> = (0..720 * 720)
            .map(|place| [place % 720, place / 720])
            .filter_map(|at| Some((at, samples.at(at[0], at[1]).filter(|sample| sample.surface.face == 1)?)))
            .map(|(at, sample)| shade.light(&samples, at, &sample))
            .collect();
        assert!(inner.len() > 10_000);
        assert!(inner.iter().all(|light| (light / inner[0] - 1.0).abs() < 1e-3));
    }
}
