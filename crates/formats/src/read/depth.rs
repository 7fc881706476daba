/// The depth that a pixel of 16 bits has, in its own unit; `None` where nothing came back. Sensors write 0 for that,
/// and the largest value for what is too far away or not valid.
pub(crate) fn depth_of(pixel: u16) -> Option<f64> {
    (pixel != 0 && pixel != u16::MAX).then(|| f64::from(pixel))
}
