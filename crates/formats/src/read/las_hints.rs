use super::las_layout::Layout;
use super::las_units::Units;

/// Largest scale for coordinates in degrees; it corresponds to a tenth of a metre on the ground.
const MAX_DEGREE_SCALE: f64 = 1e-6;
/// Maximum extent of x and y of a file in degrees. Its heights are in metres.
const MAX_DEGREES: f64 = 2.0;
/// Maximum plausible height and width, in metres, of a cloud without a coordinate system.
const MAX_HEIGHT_M: f64 = 2000.0;
const MAX_WIDTH_M: f64 = 100_000.0;

/// Returns a remark if the coordinates of a file without a coordinate system look like degrees or millimetres.
pub(super) fn hints(layout: &Layout, units: &Units) -> Option<String> {
    if units.is_known || layout.points == 0 {
        return None;
    }
    let [x, y, z] = [0, 1, 2].map(|axis| layout.bounds(axis));
    let (x, y, z) = (x?, y?, z?);
    let [x_span, y_span, z_span] = [x, y, z].map(|(least, most)| most - least);
    let [x_scale, y_scale, z_scale] = [0, 1, 2].map(|axis| layout.transform(axis).0.abs());
    let are_angles = x.0 >= -180.0 && x.1 <= 360.0 && y.0 >= -90.0 && y.1 <= 90.0;
    // Coordinates in metres have the same scale on all axes, and the cloud is wider than high.
    let is_narrow = x_span.max(y_span) <= MAX_DEGREES && z_span > 2.0 * x_span.max(y_span);
    let is_finer = z_scale >= 100.0 * x_scale.max(y_scale);
    if are_angles && x_scale.max(y_scale) <= MAX_DEGREE_SCALE && (is_finer || is_narrow) {
        return Some(format!(
            "x and y look like degrees ({} to {}, {} to {}, in steps of {x_scale}) and are read as metres, because the \
             file names no coordinate system; if they are degrees, project the file first (PDAL: filters.reprojection)",
            x.0, x.1, y.0, y.1
        ));
    }
    (z_span > MAX_HEIGHT_M || x_span.max(y_span) > MAX_WIDTH_M).then(|| {
        format!(
            "the points span {x_span} by {y_span} by {z_span} m, assuming metres because the file names no unit: if \
             they are millimetres or feet, scale them first"
        )
    })
}
