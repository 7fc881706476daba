use crate::random_scans::{Random, random_scan};
use voxtile::scan::{PointAttributes, Scan, ScanRef};
use voxtile::space::Point;

/// A scan with attributes and perhaps a time stamp.
pub struct AttributedScan {
    pub scan: Scan,
    pub attributes: PointAttributes,
    pub stamp_ns: Option<i64>,
}

impl AttributedScan {
    pub fn random(random: &mut Random, center: Point, points: usize) -> Self {
        let scan = random_scan(random, center, points);
        let attributes = random_attributes(random, points);
        Self { scan, attributes, stamp_ns: random_stamp_ns(random) }
    }

    pub fn points(&self) -> ScanRef<'_> {
        let points = ScanRef::in_world(self.scan.origin, &self.scan.points);
        let points = match &self.scan.intensities {
            Some(intensities) => points.with_intensities(intensities).unwrap(),
            None => points,
        };
        let points = points.with_attributes(&self.attributes).unwrap();
        self.stamp_ns.map_or(points, |stamp_ns| points.with_stamp_ns(stamp_ns))
    }

    /// Keeps the points for which `keeps` returns true.
    pub fn retain(&mut self, keeps: impl Fn(Point) -> bool) {
        let keeps: Vec<bool> = self.scan.points.iter().map(|point| keeps(*point)).collect();
        retain_marked(&mut self.scan.points, &keeps);
        self.scan.intensities.iter_mut().for_each(|intensities| retain_marked(intensities, &keeps));
        retain_attributes(&mut self.attributes, &keeps);
    }
}

/// Colours and classes, or one of these, or none; each misses at some points.
pub fn random_attributes(random: &mut Random, points: usize) -> PointAttributes {
    let mut attributes = PointAttributes::default();
    let (has_colours, has_classes) = (random.below(4) > 0, random.below(4) > 0);
    for _ in 0..points {
        if has_colours {
            let colour = [0; 3].map(|_| random.below(256) as u8);
            attributes.colours.push((random.below(8) > 0).then_some(colour));
        }
        if has_classes {
            let class = [2, 2, 2, 6, 0, 255][random.below(6) as usize];
            attributes.classes.push((random.below(8) > 0).then_some(class));
        }
    }
    attributes
}

/// None, an extreme one, or one of several centuries.
pub fn random_stamp_ns(random: &mut Random) -> Option<i64> {
    let stamps_ns = [None, Some(i64::MIN), Some(i64::MAX), Some(random.next() as i64 >> 8)];
    stamps_ns[random.below(4) as usize]
}

/// Keeps the attributes of the marked points.
pub fn retain_attributes(attributes: &mut PointAttributes, keeps: &[bool]) {
    retain_marked(&mut attributes.colours, keeps);
    retain_marked(&mut attributes.classes, keeps);
    retain_marked(&mut attributes.times_ns, keeps);
}

/// Keeps the marked entries.
pub fn retain_marked<T>(list: &mut Vec<T>, keeps: &[bool]) {
    let mut keeps = keeps.iter();
    list.retain(|_| *keeps.next().unwrap());
}
