use indicatif::HumanCount;

/// Rounds large numbers to integers and small ones to three digits.
pub fn rounded(number: f64) -> String {
    match number {
        100.0.. => HumanCount(number.round() as u64).to_string(),
        1.0..100.0 => format!("{number:.1}"),
        _ => format!("{number:.3}"),
    }
}
