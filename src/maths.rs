//! Deterministic mathematics: bit-identical on all platforms.
//!
//! IEEE 754 specifies `+ - * /` and `sqrt`; all other functions are from the pure-Rust `libm`, never from the
//! platform's library, and no operations are contracted into a fused multiply-add.

/// Log-odds of a probability in (0, 1): `ln(p / (1 - p))`.
pub fn logit(probability: f64) -> f64 {
    libm::log(probability / (1.0 - probability))
}

/// Smallest log-odds that count as reaching a probability: the smaller of its logit in double precision and in single
/// precision. OctoMap's files contain log-odds in single precision.
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
