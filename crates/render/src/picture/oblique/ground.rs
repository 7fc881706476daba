use super::super::canvas::Canvas;
use super::super::scale::round_length_m;
use super::super::theme::Theme;
use super::extent::Bounds;
use super::plan::Plan;

/// Grid of round lengths on the ground below the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ground {
    /// Distance between lines in metres.
    pub every_m: f64,
    /// Numbers of the first and the last line across x and y.
    lines: [[i64; 2]; 2],
    /// Height in voxels from the base.
    height: f64,
    /// Origin of the map in voxels from the base, and edge of a voxel.
    origin: [f64; 2],
    resolution_m: f64,
}

/// Minimum number of spaces along the longer edge of the map.
const SPACES: f64 = 6.0;
const OPACITY: f64 = 0.4;

impl Ground {
    /// Returns the grid below voxels in these bounds, up to the lines around them.
    pub fn of(plan: &Plan, bounds: &Bounds, resolution_m: f64) -> Self {
        let [x, y, z] = bounds.map;
        let longest_m = (x[1] - x[0]).max(y[1] - y[0]).max(1.0) * resolution_m;
        let every_m = round_length_m(longest_m / SPACES);
        let origin = [0, 1].map(|k| -f64::from(plan.frame.base[k]));
        let lines = std::array::from_fn(|k| {
            let number = |at: f64| (at - origin[k]) * resolution_m / every_m;
            [number([x, y][k][0]).floor() as i64, number([x, y][k][1]).ceil() as i64]
        });
        Self { every_m, lines, height: z[0], origin, resolution_m }
    }

    /// Draws the grid into the image, whose upper left corner is at a pixel.
    pub fn draw(&self, canvas: &mut Canvas, plan: &Plan, corner: [usize; 2], width: f64, theme: &Theme) {
        let at = |axis: usize, line: i64| self.origin[axis] + line as f64 * self.every_m / self.resolution_m;
        let ends = [0, 1].map(|axis| self.lines[axis].map(|line| at(axis, line)));
        for axis in 0..2 {
            for line in self.lines[axis][0]..=self.lines[axis][1] {
                let ends_px = ends[1 - axis].map(|other| {
                    let across = at(axis, line);
                    let [x, y] = if axis == 0 { [across, other] } else { [other, across] };
                    plan.position_px([x, y, self.height]).0
                });
                if let Some(inside) = clipped(ends_px, plan.size_px.map(|px| px as f64)) {
                    let line = inside.map(|[x, y]| [x + corner[0] as f64, y + corner[1] as f64]);
                    canvas.line(line, width, theme.line, OPACITY);
                }
            }
        }
    }
}

/// Returns the part of a line inside of a rectangle from the origin; `None` if it is outside.
pub fn clipped(line: [[f64; 2]; 2], size: [f64; 2]) -> Option<[[f64; 2]; 2]> {
    let [from, to] = line;
    let (mut first, mut last) = (0.0_f64, 1.0_f64);
    for k in 0..2 {
        let along = to[k] - from[k];
        if along == 0.0 {
            if !(0.0..=size[k]).contains(&from[k]) {
                return None;
            }
            continue;
        }
        let shares = [-from[k] / along, (size[k] - from[k]) / along];
        first = first.max(shares[0].min(shares[1]));
        last = last.min(shares[0].max(shares[1]));
    }
    let at = |share: f64| std::array::from_fn(|k| from[k] + share * (to[k] - from[k]));
    (first < last).then(|| [at(first), at(last)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_at_the_border() {
        let size = [100.0, 50.0];
        assert_eq!(clipped([[-50.0, 25.0], [150.0, 25.0]], size), Some([[0.0, 25.0], [100.0, 25.0]]));
        assert_eq!(clipped([[10.0, 10.0], [20.0, 30.0]], size), Some([[10.0, 10.0], [20.0, 30.0]]));
        assert_eq!(clipped([[-10.0, 60.0], [110.0, 60.0]], size), None);
        assert_eq!(clipped([[-10.0, -10.0], [-20.0, 90.0]], size), None);
        assert_eq!(clipped([[50.0, -50.0], [50.0, 25.0]], size), Some([[50.0, 0.0], [50.0, 25.0]]));
    }
}
