/// Converts a channel of an sRGB colour to linear light, 0 to 65535, as glTF stores the colours of vertices. Different
/// channels have different values, so readers can convert them back exactly.
pub(super) fn linear_of_srgb(channel: u8) -> u16 {
    let share = f64::from(channel) / 255.0;
    let linear = if share <= 0.04045 { share / 12.92 } else { ((share + 0.055) / 1.055).powf(2.4) };
    (linear * f64::from(u16::MAX)).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn channels_convert_back() {
        let all: Vec<u16> = (0..=255).map(linear_of_srgb).collect();
        assert_eq!([all[0], all[188], all[255]], [0, 32_957, 65_535]);
        for (channel, linear) in all.iter().enumerate() {
            let share = f64::from(*linear) / 65_535.0;
            let back =
                if share <= 0.003_130_8 { 12.92 * share } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 };
            assert_eq!((255.0 * back).round() as usize, channel);
        }
    }
}
