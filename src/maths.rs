//! Deterministic mathematics: the same bits on every platform.
//!
//! IEEE 754 fixes `+ - * /` and `sqrt`; everything else comes from the pure-Rust `libm`, never from the
//! platform's library, and nothing is contracted into a fused multiply-add.

/// Log-odds of a probability in (0, 1): `ln(p / (1 - p))`.
pub fn logit(probability: f64) -> f64 {
    libm::log(probability / (1.0 - probability))
}

/// The least log-odds that count as a probability: those of it in double or in single precision, whichever is less.
/// OctoMap's files have the second.
pub fn least_logit(probability: f64) -> f64 {
    let exact = logit(probability);
    exact.min(f64::from(exact as f32))
}

/// Probability of log-odds: `1 / (1 + e^-L)`.
pub fn sigmoid(log_odds: f64) -> f64 {
    1.0 / (1.0 + libm::exp(-log_odds))
}

/// Two to the power of a number.
pub fn exp2(power: f64) -> f64 {
    libm::exp2(power)
}

/// Sine and cosine of an angle in radians.
pub fn sin_cos(angle_rad: f64) -> (f64, f64) {
    libm::sincos(angle_rad)
}
