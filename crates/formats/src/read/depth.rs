/// Returns the depth of a 16-bit pixel, in the image's unit; `None` without a return. Sensors write 0 for that, and the
/// largest value for depths that are out of range or invalid.
pub(crate) fn depth_of(pixel: u16) -> Option<f64> {
    (pixel != 0 && pixel != u16::MAX).then(|| f64::from(pixel))
}
