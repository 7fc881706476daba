use super::labels::layer_name;
use super::layer_cells::LayerValue;
use super::legend::Entry;
use super::options::Picture;
use super::palette::{self, Rgb};
use super::time_labels::short_time_labels;
use super::view::ColorBy;
use crate::Layer;
use crate::classes::{class_color, class_label};
use voxtile::Layers;

const SECONDS_A_NS: f64 = 1e-9;

/// Values of occupied voxels, and their colors.
pub(super) struct Values<'a> {
    pub picture: &'a Picture,
    /// Layers of the map.
    pub layers: Layers,
    /// Values of the first and the last color.
    pub range: Option<[f64; 2]>,
}

impl Values<'_> {
    /// Returns the color of a value.
    pub fn color_of(&self, value: f64) -> Rgb {
        let [least, most] = self.range.unwrap_or([0.0, 1.0]);
        self.picture.color_map.color_of(match self.picture.color_by {
            // Logarithmic: most voxels have few observations, some have very many.
            ColorBy::Count => ((value + 1.0) / (least + 1.0)).ln() / ((most + 1.0) / (least + 1.0)).ln(),
            _ => (value - least) / (most - least),
        })
    }

    /// Returns the color of a value of a layer.
    pub fn color_of_layer(&self, value: Option<LayerValue>) -> Rgb {
        match value {
            Some(LayerValue::Colour(color)) => color,
            Some(LayerValue::Class(class)) => class_color(class),
            Some(value) => self.number_of(value).map_or(palette::NO_VALUE, |number| self.color_of(number)),
            None => palette::NO_VALUE,
        }
    }

    /// Returns a value of a layer as a number: an intensity in the unit of the points, a time in seconds.
    pub fn number_of(&self, value: LayerValue) -> Option<f64> {
        match value {
            LayerValue::Intensity(share) => Some(share * f64::from(self.layers.intensity_max.unwrap_or(1.0))),
            LayerValue::Time(ns) => Some(ns as f64 * SECONDS_A_NS),
            LayerValue::Colour(_) | LayerValue::Class(_) => None,
        }
    }

    /// Returns the range of values: from the 2nd to the 98th percentile, and of all times.
    pub fn range_of(&self, mut values: Vec<f64>) -> Option<[f64; 2]> {
        values.sort_unstable_by(f64::total_cmp);
        let (few, apart) = match self.picture.color_by {
            ColorBy::Layer(Layer::Time) => (0, 1.0),
            ColorBy::Layer(_) => {
                (values.len() / 50, 1e-6 * f64::from(self.layers.intensity_max.unwrap_or(1.0)))
            }
            ColorBy::Height => (values.len() / 50, 0.01),
            _ => (values.len() / 50, 1.0),
        };
        let most = values.len().checked_sub(1 + few)?;
        Some([values[few], values[most].max(values[few] + apart)])
    }

    /// Returns entries of the legend: for classes, for voxels without a value, and the date of times.
    pub fn entries(&self, classes: &[(u8, u64)], without_value: u64) -> Vec<Entry> {
        let class =
            |&(class, _): &(u8, u64)| Entry { color: Some(class_color(class)), label: class_label(class) };
        let mut entries: Vec<Entry> = classes.iter().map(class).collect();
        if let (ColorBy::Layer(layer), 1..) = (self.picture.color_by, without_value) {
            let label = format!("no {}", layer_name(layer));
            entries.push(Entry { color: Some(palette::NO_VALUE), label });
        }
        if let (ColorBy::Layer(Layer::Time), Some(range)) = (self.picture.color_by, self.range)
            && let (_, Some(date)) = short_time_labels(range)
        {
            entries.push(Entry { color: None, label: format!("last hit: {date} UTC") });
        }
        entries
    }
}
