use voxtile::{Error, Result};

/// Largest cap in voxels: its square fits in 15 bits.
pub const MAX_CAP_VOXELS: u32 = 181;

/// Cap of a field, in voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Cap {
    /// Largest squared distance within the cap.
    pub(crate) squared: i16,
    /// Largest distance along an axis within the cap.
    pub(crate) reach: usize,
}

impl Cap {
    /// Converts a cap in metres.
    ///
    /// # Errors
    ///
    /// Fails unless the cap is from one to [`MAX_CAP_VOXELS`] voxels.
    pub(crate) fn of(max_distance_m: f64, resolution_m: f64) -> Result<Self> {
        let voxels = max_distance_m / resolution_m;
        // Tolerates the rounding of the division: 0.3 m are 3 voxels of 0.1 m.
        let squared = (voxels * voxels * (1.0 + 1e-9)).floor();
        let most = MAX_CAP_VOXELS * MAX_CAP_VOXELS;
        if max_distance_m > 0.0 && (1.0..=f64::from(most)).contains(&squared) {
            return Ok(Self { squared: squared as i16, reach: squared.sqrt() as usize });
        }
        let largest_m = (f64::from(MAX_CAP_VOXELS) * resolution_m * 1e6).round() / 1e6;
        let reason = format!(
            "{max_distance_m} m, but with voxels of {resolution_m} m it must be from {resolution_m} m to {largest_m} m"
        );
        Err(Error::argument("max_distance", reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn caps_are_converted_without_rounding_noise() {
        for (max_distance_m, squared, reach) in
            [(0.3, 9, 3), (5.0, 2500, 50), (0.1, 1, 1), (0.15, 2, 1), (18.1, 32761, 181)]
        {
            assert_eq!(Cap::of(max_distance_m, 0.1).unwrap(), Cap { squared, reach }, "{max_distance_m}");
        }
    }

    #[test]
    fn invalid_caps_are_refused_with_the_valid_range() {
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY, 0.099, 18.2, 1e300] {
            let message = Cap::of(wrong, 0.1).unwrap_err().to_string();
            assert!(message.contains("from 0.1 m to 18.1 m"), "{wrong}: {message}");
        }
    }
}
