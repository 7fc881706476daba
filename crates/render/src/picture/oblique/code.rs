use super::super::cells::{ordered, unordered};
use super::super::layer_cells::LayerValue;
use crate::Layer;
use std::sync::atomic::{AtomicI64, Ordering};

/// Values of voxels in 32 bits. The codes of numbers have their order.
pub enum Coding {
    /// Numbers that are no values of a layer.
    Number,
    /// Values of a layer; 0 is none.
    Layer(Layer, Times),
}

/// Value of a voxel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Number(f32),
    Layer(Option<LayerValue>),
}

/// First and last time of all voxels in nanoseconds.
pub struct Times {
    first: AtomicI64,
    last: AtomicI64,
}

const COLOUR: u32 = 1 << 24;

impl Times {
    pub fn none() -> Self {
        Self { first: AtomicI64::new(i64::MAX), last: AtomicI64::new(i64::MIN) }
    }

    pub fn add(&self, ns: i64) {
        self.first.fetch_min(ns, Ordering::Relaxed);
        self.last.fetch_max(ns, Ordering::Relaxed);
    }

    /// Returns the first time, and the nanoseconds of a step of the codes.
    fn scale(&self) -> (i64, u64) {
        let [first, last] = [&self.first, &self.last].map(|time| time.load(Ordering::Relaxed));
        (first, last.abs_diff(first).div_ceil(u64::from(u32::MAX) - 1).max(1))
    }
}

impl Coding {
    pub fn code(&self, value: Value) -> u32 {
        match (self, value) {
            (_, Value::Number(number)) => ordered(number),
            (_, Value::Layer(None)) => 0,
            (_, Value::Layer(Some(LayerValue::Colour([red, green, blue])))) => {
                COLOUR | u32::from(red) << 16 | u32::from(green) << 8 | u32::from(blue)
            }
            (_, Value::Layer(Some(LayerValue::Intensity(share)))) => {
                1 + (share.clamp(0.0, 1.0) * f64::from(u16::MAX)).round() as u32
            }
            (_, Value::Layer(Some(LayerValue::Class(class)))) => 1 + u32::from(class),
            (Self::Layer(_, times), Value::Layer(Some(LayerValue::Time(ns)))) => {
                let (first, step) = times.scale();
                1 + u32::try_from(ns.abs_diff(first.min(ns)) / step).unwrap_or(u32::MAX - 1).min(u32::MAX - 1)
            }
            (Self::Number, Value::Layer(Some(LayerValue::Time(_)))) => 0,
        }
    }

    pub fn value(&self, code: u32) -> Value {
        let Self::Layer(layer, times) = self else { return Value::Number(unordered(code)) };
        let Some(number) = code.checked_sub(1) else { return Value::Layer(None) };
        Value::Layer(Some(match layer {
            Layer::Colour => {
                let [_, red, green, blue] = code.to_be_bytes();
                LayerValue::Colour([red, green, blue])
            }
            Layer::Intensity => LayerValue::Intensity(f64::from(number) / f64::from(u16::MAX)),
            Layer::Class => LayerValue::Class(number.min(255) as u8),
            Layer::Time => {
                let (first, step) = times.scale();
                LayerValue::Time(first.saturating_add_unsigned(u64::from(number).saturating_mul(step)))
            }
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_have_their_values() {
        for number in [-2.5, 0.0, 1e-9, 3e7] {
            let value = Value::Number(number);
            assert_eq!(Coding::Number.value(Coding::Number.code(value)), value);
        }
        let of = |layer: Layer| Coding::Layer(layer, Times::none());
        for (layer, value) in [
            (Layer::Colour, LayerValue::Colour([0, 0, 0])),
            (Layer::Colour, LayerValue::Colour([1, 200, 255])),
            (Layer::Intensity, LayerValue::Intensity(0.0)),
            (Layer::Intensity, LayerValue::Intensity(1.0)),
            (Layer::Class, LayerValue::Class(0)),
            (Layer::Class, LayerValue::Class(255)),
        ] {
            let coding = of(layer);
            assert_eq!(coding.value(coding.code(Value::Layer(Some(value)))), Value::Layer(Some(value)));
            assert_eq!(coding.value(coding.code(Value::Layer(None))), Value::Layer(None));
        }
    }

    #[test]
    fn times_of_any_range_keep_their_order() {
        for times in [[0, 1, 2_000_000_000], [i64::MIN, 0, i64::MAX], [7, 7, 7]] {
            let known = Times::none();
            times.iter().for_each(|&ns| known.add(ns));
            let coding = Coding::Layer(Layer::Time, known);
            let codes = times.map(|ns| coding.code(Value::Layer(Some(LayerValue::Time(ns)))));
            assert!(codes[0] > 0 && codes[0] <= codes[1] && codes[1] <= codes[2], "{codes:?}");
            for (ns, code) in times.into_iter().zip(codes) {
                let Value::Layer(Some(LayerValue::Time(found))) = coding.value(code) else { panic!() };
                assert!(found.abs_diff(ns) <= times[2].abs_diff(times[0]) >> 31, "{found} for {ns}");
            }
        }
    }
}
