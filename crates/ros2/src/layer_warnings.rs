use std::collections::BTreeSet;
use voxtile::Layers;
use voxtile::scan::ScanPoints;

/// Warns once of each layer of the map that clouds do not fill.
#[derive(Debug, Default)]
pub struct LayerWarnings {
    warned: BTreeSet<&'static str>,
    remarks: usize,
}

impl LayerWarnings {
    /// Returns the warnings about a cloud.
    pub fn of(&mut self, layers: &Layers, scan: &dyn ScanPoints) -> Vec<String> {
        if scan.is_empty() {
            return Vec::new();
        }
        let attributes = scan.attributes();
        let missing = [
            (layers.colour && !attributes.colours, "colour"),
            (layers.intensity_max.is_some() && !scan.has_intensities(), "intensity"),
            (layers.class && !attributes.classes, "class"),
        ];
        let new = missing.into_iter().filter(|(is_missing, layer)| *is_missing && self.warned.insert(*layer));
        new.map(|(_, layer)| format!("the map has the layer {layer}, but a cloud has no such field"))
            .collect()
    }

    /// Returns the remarks about values of attributes, if there is a new one.
    pub fn new_remarks(&mut self, remarks: Vec<String>) -> Vec<String> {
        let before = std::mem::replace(&mut self.remarks, remarks.len());
        if remarks.len() > before { remarks } else { Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{PointAttributes, ScanRef};

    #[test]
    fn each_layer_without_a_field_is_named_once() {
        let layers: Layers = "colour,class,time".parse().unwrap();
        let attributes =
            PointAttributes { colours: Vec::new(), classes: vec![Some(1)], ..PointAttributes::default() };
        let points = [[1.0; 3]];
        let scan = ScanRef::in_world([0.0; 3], &points).with_attributes(&attributes).unwrap();
        let mut warnings = LayerWarnings::default();
        assert!(warnings.of(&layers, &ScanRef::in_world::<f64>([0.0; 3], &[])).is_empty());
        let first = warnings.of(&layers, &scan);
        assert!(matches!(&first[..], [one] if one.contains("the layer colour,")), "{first:?}");
        assert!(warnings.of(&layers, &scan).is_empty());
        assert_eq!(warnings.new_remarks(vec!["a".to_owned()]).len(), 1);
        assert!(warnings.new_remarks(vec!["a, twice".to_owned()]).is_empty());
    }
}
