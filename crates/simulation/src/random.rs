/// Seeded pseudorandom numbers (SplitMix64), identical on all platforms.
#[derive(Clone, Debug)]
pub struct Random {
    state: u64,
}

/// Odd increment of SplitMix64: 2^64 divided by the golden ratio.
const STEP: u64 = 0x9E37_79B9_7F4A_7C15;

impl Random {
    /// Returns the generator for one object, identified by a list of numbers. Generators of different objects or seeds
    /// are independent.
    pub fn of(seed: u64, name: &[i64]) -> Self {
        let fold = |state: u64, part: &i64| mixed(state.wrapping_add(STEP) ^ mixed(*part as u64));
        Self { state: name.iter().fold(mixed(seed.wrapping_add(STEP)), fold) }
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.state = self.state.wrapping_add(STEP);
        mixed(self.state)
    }

    /// Returns a number in `low..high` (or `low` if both are equal).
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        // The upper 53 bits are an integer that an f64 represents exactly.
        let unit = (self.bits() >> 11) as f64 * (1.0 / 9_007_199_254_740_992.0);
        low + (high - low) * unit
    }

    /// Returns an integer in `0..end` (0 if `end` is 0).
    pub fn below(&mut self, end: u64) -> u64 {
        ((u128::from(self.bits()) * u128::from(end)) >> 64) as u64
    }

    /// Returns true with this probability.
    pub fn chance(&mut self, probability: f64) -> bool {
        self.between(0.0, 1.0) < probability
    }

    /// Returns a bell-shaped number with mean 0 and standard deviation 1, between -3.47 and 3.47.
    ///
    /// It is the sum of four uniform numbers: without a logarithm it is exact on all platforms.
    pub fn bell(&mut self) -> f64 {
        let bits = self.bits();
        let sum: u64 = (0..4).map(|quarter| (bits >> (16 * quarter)) & 0xFFFF).sum();
        const SQRT_3: f64 = 1.732_050_807_568_877_2;
        (sum as f64 - 131_070.0) * (SQRT_3 / 65_536.0)
    }
}

/// Finaliser of SplitMix64: every input bit changes about half of the output bits.
fn mixed(mut bits: u64) -> u64 {
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    bits ^ (bits >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_those_of_splitmix64() {
        // First numbers of the reference implementation for state 0.
        let mut random = Random { state: 0 };
        assert_eq!(random.bits(), 0xE220_A839_7B1D_CDAF);
        assert_eq!(random.bits(), 0x6E78_9E6A_A1B9_65F4);
        assert_eq!(random.bits(), 0x06C4_5D18_8009_454F);
    }

    #[test]
    fn numbers_stay_in_their_range_and_fill_it() {
        let mut random = Random::of(1, &[]);
        let numbers: Vec<f64> = (0..10_000).map(|_| random.between(-2.0, 3.0)).collect();
        assert!(numbers.iter().all(|x| (-2.0..3.0).contains(x)));
        assert!((numbers.iter().sum::<f64>() / 1e4 - 0.5).abs() < 0.05);
        let mut seen = [false; 7];
        (0..200).for_each(|_| seen[random.below(7) as usize] = true);
        assert_eq!(seen, [true; 7]);
        assert_eq!(random.below(0), 0);
    }

    #[test]
    fn bell_has_mean_zero_and_deviation_one() {
        let mut random = Random::of(2, &[]);
        let numbers: Vec<f64> = (0..100_000).map(|_| random.bell()).collect();
        let mean = numbers.iter().sum::<f64>() / 1e5;
        let variance = numbers.iter().map(|x| x * x).sum::<f64>() / 1e5;
        assert!(mean.abs() < 0.02 && (variance - 1.0).abs() < 0.02, "{mean} {variance}");
    }

    #[test]
    fn generators_of_other_objects_are_independent() {
        let first = |seed, name: &[i64]| Random::of(seed, name).bits();
        assert_ne!(first(1, &[0, 1]), first(1, &[1, 0]));
        assert_ne!(first(1, &[0]), first(1, &[0, 0]));
        assert_ne!(first(1, &[0]), first(2, &[0]));
    }
}
