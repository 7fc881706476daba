use crate::args::MaxHeight;
use voxtile::Result;
use voxtile::space::Point;
use voxtile_pipeline::AnyMap;
use voxtile_render::Roof;

/// Height limit of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceiling {
    pub max_height_m: Option<f64>,
    /// Whether the limit is the height of the sensor, because most columns are roofed.
    is_of_sensor: bool,
}

impl Ceiling {
    /// Returns the limit of a picture; `is_from_above`: whether a ceiling would hide the map.
    pub fn of(choice: MaxHeight, map: &AnyMap, path: &[Point], is_from_above: bool) -> Result<Self> {
        let (max_height_m, is_of_sensor) = match (choice, map) {
            (MaxHeight::Metres(height_m), _) => (Some(height_m), false),
            (MaxHeight::Auto, AnyMap::Map(map)) if is_from_above => {
                (Roof::of(map.as_ref(), path)?.and_then(|roof| roof.cut_m()), true)
            }
            _ => (None, false),
        };
        Ok(Self { max_height_m, is_of_sensor })
    }

    /// Returns the end of a title that names the limit; empty without one.
    pub fn caption(&self) -> String {
        match self.max_height_m {
            Some(height_m) if self.is_of_sensor => format!(", ceiling cut at {height_m:.2} m (sensor)"),
            Some(height_m) => format!(", below {height_m} m"),
            None => String::new(),
        }
    }

    /// Returns the limit in words, for a sentence; empty without one.
    pub fn remark(&self) -> String {
        match self.max_height_m {
            Some(height_m) if self.is_of_sensor => {
                format!(" without the ceiling, up to the sensor at {height_m:.2} m")
            }
            Some(height_m) => format!(" below {height_m} m"),
            None => String::new(),
        }
    }
}
