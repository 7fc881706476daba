use super::canvas::Canvas;
use super::collect::Known;
use super::measure::Measure;
use super::options::{MAX_PX, Picture};
use super::palette::Rgb;
use super::pane::Pane;

/// Radius of the line in metres, and its maximum in points.
const RADIUS_M: f64 = 0.2;
const MAX_RADIUS_PT: f64 = 1.6;

/// Draws the trajectory as a line, with gaps at jumps such as the start of another recording.
pub(super) fn draw_trajectory(
    canvas: &mut Canvas,
    picture: &Picture,
    known: &Known,
    pane: &Pane,
    resolution_m: f64,
    measure: Measure,
    [color, rim]: [Rgb; 2],
) {
    let positions: Vec<[f64; 2]> =
        picture.path.iter().map(|&place| known.frame.position_of(place, resolution_m)).collect();
    let length = |pair: &[[f64; 2]]| (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
    let mut steps: Vec<f64> = positions.windows(2).map(length).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or_default();
    let longest = 8.0 * usual.max(2.0 / pane.zoom as f64);
    let mut middles: Vec<[usize; 2]> =
        positions.first().and_then(|&at| pane.pixel_of(at)).into_iter().collect();
    for pair in positions.windows(2) {
        let length = length(pair);
        // One step per pixel. The bound is longer than any line inside the picture.
        let parts = (length * pane.zoom as f64).ceil().clamp(1.0, 4.0 * MAX_PX as f64) as usize;
        let parts = if length <= longest { parts } else { 1 };
        for part in 1..=parts {
            let share = part as f64 / parts as f64;
            let at = std::array::from_fn(|k| pair[0][k] * (1.0 - share) + pair[1][k] * share);
            if let Some(pixel) = pane.pixel_of(at)
                && middles.last() != Some(&pixel)
            {
                middles.push(pixel);
            }
        }
    }
    // Draw each pixel once, even if the sensor was at rest there for hours.
    middles.sort_unstable();
    middles.dedup();
    let pixels_a_metre = pane.zoom as f64 / (known.frame.voxels_a_cell as f64 * resolution_m);
    // A wider line would hide the streets of a large map.
    let most = if picture.has_legend { measure.px(MAX_RADIUS_PT) } else { 1 };
    let radius = ((RADIUS_M * pixels_a_metre) as usize).clamp(usize::from(picture.has_legend), most);
    canvas.path(middles.into_iter(), radius, color, rim);
}
