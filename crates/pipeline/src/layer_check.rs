use voxtile::scan::{AttributeSet, ScanPoints};
use voxtile::{Layers, Result};

/// Compares the attributes of an input with the layers of the map.
#[derive(Debug)]
pub struct LayerCheck {
    layers: Layers,
    scans: u64,
    found: AttributeSet,
    has_intensities: bool,
    has_stamps: bool,
    /// Largest finite intensity.
    largest: f32,
}

/// Share of the layer's largest intensity below which its integers are too coarse.
const TOO_SMALL: f32 = 0.02;

impl LayerCheck {
    pub fn new(layers: Layers) -> Self {
        Self {
            layers,
            scans: 0,
            found: AttributeSet::NONE,
            has_intensities: false,
            has_stamps: false,
            largest: 0.0,
        }
    }

    /// Notes the attributes of a scan.
    ///
    /// # Errors
    ///
    /// The points cannot be read.
    pub fn note(&mut self, scan: &dyn ScanPoints) -> Result<()> {
        if self.layers.is_none() || scan.is_empty() {
            return Ok(());
        }
        self.scans += 1;
        self.found.colours |= scan.attributes().colours;
        self.found.classes |= scan.attributes().classes;
        self.has_intensities |= scan.has_intensities();
        self.has_stamps |= scan.stamp_ns().is_some();
        if self.layers.intensity_max.is_some() && scan.has_intensities() {
            scan.for_each_own_chunk(0..scan.len(), &mut |_, intensities| {
                let finite = intensities.unwrap_or_default().iter().filter(|intensity| intensity.is_finite());
                self.largest = finite.fold(self.largest, |largest, intensity| largest.max(*intensity));
                true
            })?;
        }
        Ok(())
    }

    /// Returns remarks on layers that the input does not fill, or not well.
    pub fn remarks(&self) -> Vec<String> {
        if self.scans == 0 {
            return Vec::new();
        }
        let Layers { colour, intensity_max, class, time, .. } = self.layers;
        let mut remarks: Vec<String> = [
            (colour && !self.found.colours, "colour", "colours"),
            (intensity_max.is_some() && !self.has_intensities, "intensity", "intensities"),
            (class && !self.found.classes, "class", "classes"),
            (time && !self.has_stamps, "time", "time stamps"),
        ]
        .into_iter()
        .filter(|(is_missing, ..)| *is_missing)
        .map(|(_, layer, attribute)| {
            format!("the map has the layer {layer}, but the scans have no {attribute}")
        })
        .collect();
        match intensity_max.filter(|_| self.has_intensities) {
            Some(max) if self.largest > max => remarks.push(format!(
                "intensities above {max} count as {max} in the layer, but there are some up to {}: a new map with \
                 `layers` intensity={} can store them",
                self.largest, self.largest
            )),
            Some(max) if self.largest > 0.0 && self.largest < TOO_SMALL * max => remarks.push(format!(
                "the largest intensity is {}, but the layer is for intensities up to {max} and rounds to {}: a new map \
                 with `layers` intensity={} keeps more digits",
                self.largest,
                max / f32::from(u16::MAX),
                self.largest
            )),
            _ => {}
        }
        remarks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{PointAttributes, ScanRef};

    fn remarks(layers: &str, intensities: [f32; 2], attributes: &PointAttributes) -> Vec<String> {
        let mut check = LayerCheck::new(layers.parse().unwrap());
        let scan = ScanRef::in_world([0.0; 3], &[[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]);
        let scan = scan.with_intensities(&intensities).unwrap().with_attributes(attributes).unwrap();
        check.note(&scan).unwrap();
        check.remarks()
    }

    #[test]
    fn layers_without_attributes_are_named() {
        let none = PointAttributes::default();
        let classes = PointAttributes { classes: vec![Some(2), None], ..none.clone() };
        assert!(remarks("none", [1.0; 2], &none).is_empty());
        let found = remarks("colour,class,time,shape", [1.0; 2], &classes);
        assert_eq!(found.len(), 2, "{found:?}");
        assert!(found[0].contains("layer colour") && found[1].contains("no time stamps"), "{found:?}");
    }

    #[test]
    fn intensities_of_another_scale_are_named() {
        let none = PointAttributes::default();
        let of = |largest| remarks("intensity=255", [f32::NAN, largest], &none);
        assert!(of(255.0).is_empty() && of(6.0).is_empty());
        assert!(of(4000.0)[0].contains("up to 4000"), "{:?}", of(4000.0));
        assert!(of(0.9)[0].contains("intensity=0.9"), "{:?}", of(0.9));
    }
}
