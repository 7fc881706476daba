use super::super::canvas::Canvas;
use super::super::measure::Measure;
use super::super::theme::Theme;
use super::ground::clipped;
use super::plan::Plan;
use super::samples::Samples;
use voxtile::space::Point;

/// Radius of the line in metres, and its minimum and maximum in points: a wide line hides streets of large maps.
const RADIUS_M: f64 = 0.2;
const RADIUS_PT: [f64; 2] = [0.4, 0.9];
/// Visible parts shorter than this many radii are holes in a surface.
const MIN_VISIBLE: usize = 8;
/// Opacity of hidden parts.
const HIDDEN: f64 = 0.35;
/// Distance in voxels up to which a surface in front does not hide the line.
const SLACK: f64 = 2.0;
/// Steps of this many times the usual length are gaps, such as the start of another recording.
const GAP: f64 = 8.0;

/// The trajectory in an image.
pub struct Trajectory<'a> {
    pub path_m: &'a [Point],
    pub samples: &'a Samples,
    pub plan: &'a Plan,
    pub resolution_m: f64,
}

impl Trajectory<'_> {
    /// Draws a line into the image, whose upper left corner is at a pixel. Parts behind occupied voxels are faint.
    pub fn draw(&self, canvas: &mut Canvas, corner: [usize; 2], measure: Measure, theme: &Theme) {
        let Self { path_m, samples, plan, resolution_m } = *self;
        let base = plan.frame.base;
        let mut places: Vec<([f64; 2], f64)> = path_m
            .iter()
            .filter(|at| at.iter().all(|k| k.is_finite()))
            .map(|at| plan.position_px(std::array::from_fn(|k| at[k] / resolution_m - f64::from(base[k]))))
            .collect();
        if let [only] = places[..] {
            places.push(only);
        }
        let length =
            |pair: &[([f64; 2], f64)]| (pair[1].0[0] - pair[0].0[0]).hypot(pair[1].0[1] - pair[0].0[1]);
        let mut steps: Vec<f64> = places.windows(2).map(length).collect();
        steps.sort_unstable_by(f64::total_cmp);
        let longest = GAP * steps.get(steps.len() / 2).copied().unwrap_or_default().max(2.0);
        let is_visible = |[x, y]: [f64; 2], near: f64| {
            let sample = [x, y].map(|k| (k * plan.samples_per_px as f64) as usize);
            let found = samples.at(sample[0], sample[1]);
            found.is_none_or(|found| found.near <= near + SLACK * plan.frame.scale)
        };
        let mut runs: Vec<(bool, Vec<[usize; 2]>)> = Vec::new();
        for pair in places.windows(2).filter(|pair| length(pair) <= longest) {
            let Some(inside) = clipped([pair[0].0, pair[1].0], plan.size_px.map(|px| px as f64 - 1e-6))
            else {
                continue;
            };
            // One step per pixel.
            let parts = (inside[1][0] - inside[0][0]).hypot(inside[1][1] - inside[0][1]).ceil().max(1.0);
            for part in 0..=parts as usize {
                let share = part as f64 / parts;
                let at: [f64; 2] =
                    std::array::from_fn(|k| inside[0][k] + share * (inside[1][k] - inside[0][k]));
                let near = pair[0].1 + share * (pair[1].1 - pair[0].1);
                let (pixel, seen) =
                    ([at[0] as usize + corner[0], at[1] as usize + corner[1]], is_visible(at, near));
                match runs.last_mut().filter(|(is_visible, _)| *is_visible == seen) {
                    Some((_, run)) => {
                        if run.last() != Some(&pixel) {
                            run.push(pixel);
                        }
                    }
                    None => runs.push((seen, vec![pixel])),
                }
            }
        }
        let [least, most] = RADIUS_PT.map(|radius_pt| measure.px(radius_pt));
        let radius = ((RADIUS_M / resolution_m * plan.zoom()) as usize).clamp(least, most);
        let (mut visible, mut hidden) = (Vec::new(), Vec::new());
        let is_one = runs.len() == 1;
        for (is_visible, run) in &mut runs {
            let is_hole = !is_one && run.len() < MIN_VISIBLE * radius;
            if *is_visible && !is_hole { &mut visible } else { &mut hidden }.append(run);
        }
        for pixels in [&mut visible, &mut hidden] {
            // Each pixel once, even if the sensor was at rest there for hours.
            pixels.sort_unstable();
            pixels.dedup();
        }
        for [x, y] in hidden {
            canvas.fill(
                x.saturating_sub(radius / 2),
                y.saturating_sub(radius / 2),
                [radius; 2],
                theme.path,
                HIDDEN / radius as f64,
            );
        }
        canvas.path(visible.into_iter(), radius, theme.path, theme.ground);
    }
}
