use super::stored_scan::StoredScan;
use voxtile::Result;
use voxtile::scan::{AttributeSet, AttributeSlices, Pose, Sweep};

/// Fingerprint of a scan: a hash of its points, intensities and attributes, and another of its pose. It does not depend on storage
/// format and file name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScanFingerprint {
    scan: [u8; FINGERPRINT_BYTES],
    pose: [u8; FINGERPRINT_BYTES],
    has_points: bool,
}

/// Fingerprint of the start of an input: hash chains over its scans and over their poses.
///
/// It has a constant size and can be extended by further scans.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ScanChain {
    scans: u64,
    scan_chain: [u8; FINGERPRINT_BYTES],
    pose_chain: [u8; FINGERPRINT_BYTES],
}

const FINGERPRINT_BYTES: usize = 16;
/// Number of points to hash at once.
const POINTS_AT_A_TIME: usize = 1024;

impl ScanFingerprint {
    /// Computes the fingerprint of a scan.
    ///
    /// # Errors
    ///
    /// Points cannot be read.
    pub fn of(scan: &StoredScan) -> Result<Self> {
        let StoredScan { points_in_sensor: store, world_from_sensor, .. } = scan;
        let mut hasher = hasher("voxtile 1 scan");
        hasher.update(&(store.len() as u64).to_le_bytes());
        let mut bytes = Vec::new();
        store.for_each_chunk(0..store.len(), &mut |points, _| {
            for points in points.chunks(POINTS_AT_A_TIME) {
                bytes.clear();
                points.iter().flatten().for_each(|&number| bytes.extend(bits(number).to_le_bytes()));
                hasher.update(&bytes);
            }
            true
        })?;
        if store.has_intensities() {
            store.for_each_chunk(0..store.len(), &mut |_, intensities| {
                for intensities in intensities.unwrap_or_default().chunks(POINTS_AT_A_TIME) {
                    bytes.clear();
                    intensities
                        .iter()
                        .for_each(|&number| bytes.extend(bits(f64::from(number)).to_le_bytes()));
                    hasher.update(&bytes);
                }
                true
            })?;
        }
        if !store.attributes().is_none() {
            hash_set(&mut hasher, store.attributes());
            store.for_each_attributed_chunk(0..store.len(), &mut |_, _, attributes| {
                hash_attributes(&mut hasher, attributes);
                true
            })?;
        }
        Ok(Self {
            scan: fingerprint(&hasher),
            pose: pose_fingerprint(world_from_sensor, store.sweep().map(|sweep| &**sweep)),
            has_points: !store.is_empty(),
        })
    }

    /// Creates a fingerprint without hashes, for callers that only need to know whether the scan has points. Hashing
    /// takes a tenth of the time of reading.
    pub fn without_content(scan: &StoredScan) -> Self {
        Self {
            scan: [0; FINGERPRINT_BYTES],
            pose: [0; FINGERPRINT_BYTES],
            has_points: !scan.points_in_sensor.is_empty(),
        }
    }

    /// Returns whether the scan has points. Scans without points are not distinguishable.
    pub fn has_points(&self) -> bool {
        self.has_points
    }

    /// Returns the hash of the scan without its pose, as 32 hexadecimal digits.
    pub fn scan_text(&self) -> String {
        to_text(&self.scan)
    }
}

impl ScanChain {
    /// Parses a chain. Returns `None` if a text is not 32 hexadecimal digits.
    pub fn from_texts(scans: u64, scan_chain: &str, pose_chain: &str) -> Option<Self> {
        Some(Self { scans, scan_chain: from_text(scan_chain)?, pose_chain: from_text(pose_chain)? })
    }

    /// Returns the number of scans so far.
    pub fn scans(&self) -> u64 {
        self.scans
    }

    /// Returns the hash chain of the scans as 32 hexadecimal digits.
    pub fn scan_text(&self) -> String {
        to_text(&self.scan_chain)
    }

    /// Returns the hash chain of the poses as 32 hexadecimal digits.
    pub fn pose_text(&self) -> String {
        to_text(&self.pose_chain)
    }

    /// Adds a scan.
    pub fn add(&mut self, fingerprint: &ScanFingerprint) {
        self.chain(&fingerprint.scan, &fingerprint.pose);
    }

    /// Adds a scan that could not be read.
    pub fn add_unread(&mut self) {
        self.chain(b"could not be read", b"could not be read");
    }

    fn chain(&mut self, scan: &[u8], pose: &[u8]) {
        self.scans += 1;
        for (chain, new) in [(&mut self.scan_chain, scan), (&mut self.pose_chain, pose)] {
            let mut hasher = hasher("voxtile 1 chain");
            hasher.update(chain);
            hasher.update(new);
            *chain = fingerprint(&hasher);
        }
    }
}

/// Hashes which attributes points have.
pub(super) fn hash_set(hasher: &mut blake3::Hasher, set: AttributeSet) {
    hasher.update(&[u8::from(set.colours), u8::from(set.classes)]);
    if set.times {
        hasher.update(&[1]);
    }
}

/// Hashes attributes point by point, so that the result does not depend on the size of chunks.
pub(super) fn hash_attributes(hasher: &mut blake3::Hasher, attributes: AttributeSlices<'_>) {
    let AttributeSlices { colours, classes, times_ns } = attributes;
    let points = colours.len().max(classes.len()).max(times_ns.len());
    let mut bytes = Vec::new();
    for first in (0..points).step_by(POINTS_AT_A_TIME) {
        bytes.clear();
        for number in first..points.min(first + POINTS_AT_A_TIME) {
            let (colour, class) = (attributes.colour(number), attributes.class(number));
            let [red, green, blue] = colour.unwrap_or_default();
            bytes.extend([u8::from(colour.is_some()), red, green, blue]);
            bytes.extend([u8::from(class.is_some()), class.unwrap_or_default()]);
            bytes.extend(times_ns.get(number).into_iter().flat_map(|time| time.to_le_bytes()));
        }
        hasher.update(&bytes);
    }
}

fn hasher(context: &str) -> blake3::Hasher {
    blake3::Hasher::new_derive_key(context)
}

fn fingerprint(hasher: &blake3::Hasher) -> [u8; FINGERPRINT_BYTES] {
    let mut fingerprint = [0; FINGERPRINT_BYTES];
    hasher.finalize_xof().fill(&mut fingerprint);
    fingerprint
}

fn pose_fingerprint(pose: &Pose, sweep: Option<&Sweep>) -> [u8; FINGERPRINT_BYTES] {
    let mut hasher = hasher("voxtile 1 pose");
    for number in pose.position_m().into_iter().chain(pose.quaternion()) {
        hasher.update(&bits(number).to_le_bytes());
    }
    if let Some(sweep) = sweep {
        let mut bytes = Vec::new();
        sweep.write(&mut bytes);
        hasher.update(&bytes);
    }
    fingerprint(&hasher)
}

/// Returns the bits of a number. All NaN have equal bits.
fn bits(number: f64) -> u64 {
    if number.is_nan() { f64::NAN.to_bits() } else { number.to_bits() }
}

fn to_text(fingerprint: &[u8; FINGERPRINT_BYTES]) -> String {
    fingerprint.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn from_text(text: &str) -> Option<[u8; FINGERPRINT_BYTES]> {
    if text.len() != 2 * FINGERPRINT_BYTES || !text.is_ascii() {
        return None;
    }
    let mut fingerprint = [0; FINGERPRINT_BYTES];
    for (k, byte) in fingerprint.iter_mut().enumerate() {
        *byte = u8::from_str_radix(&text[2 * k..2 * k + 2], 16).ok()?;
    }
    Some(fingerprint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PointStore;
    use nalgebra::Isometry3;

    fn scan(points: &[[f64; 3]], intensity: Option<f32>, x_m: f64) -> StoredScan {
        let mut points_in_sensor = PointStore::default();
        points_in_sensor.begin(intensity.is_some());
        points.iter().for_each(|point| points_in_sensor.push(*point, intensity.unwrap_or_default()).unwrap());
        StoredScan {
            name: "any".into(),
            stamp_ns: None,
            points_in_sensor,
            world_from_sensor: Isometry3::translation(x_m, 0.0, 0.0).into(),
        }
    }

    fn fingerprint_of(scan: &StoredScan) -> ScanFingerprint {
        ScanFingerprint::of(scan).unwrap()
    }

    #[test]
    fn chains_distinguish_scans_and_poses_and_resume_from_text() {
        let first_points = [[1.0, 2.0, 3.0]];
        let scans = || {
            [scan(&first_points, None, 0.0), scan(&[], None, 1.0), scan(&[[f64::NAN; 3]; 3000], None, 2.0)]
        };
        let chain_of = |scans: &[StoredScan]| {
            let mut chain = ScanChain::default();
            scans.iter().for_each(|scan| chain.add(&fingerprint_of(scan)));
            chain
        };
        let whole = chain_of(&scans());
        let first = chain_of(&scans()[..2]);
        let mut on = ScanChain::from_texts(2, &first.scan_text(), &first.pose_text()).unwrap();
        on.add(&fingerprint_of(&scans()[2]));
        assert_eq!(on, whole);

        let mut moved = scans();
        moved[1].world_from_sensor = Isometry3::translation(1.5, 0.0, 0.0).into();
        let moved = chain_of(&moved);
        assert_eq!(moved.scan_text(), whole.scan_text());
        assert_ne!(moved.pose_text(), whole.pose_text());

        let mut changed = scans();
        let mut points = vec![[f64::NAN; 3]; 3000];
        points[2999] = [0.0; 3];
        changed[2] = scan(&points, None, 2.0);
        let changed = chain_of(&changed);
        assert_ne!(changed.scan_text(), whole.scan_text());
        assert_eq!(changed.pose_text(), whole.pose_text());

        let of = |intensity| fingerprint_of(&scan(&first_points, intensity, 0.0)).scan_text();
        let fingerprints = [None, Some(1.0), Some(2.0)].map(of);
        assert!(fingerprints[0] != fingerprints[1] && fingerprints[1] != fingerprints[2], "{fingerprints:?}");

        let painted = |colour: Option<[u8; 3]>, class: Option<u8>| {
            let mut scan = scan(&[], None, 0.0);
            scan.points_in_sensor
                .begin_with(false, AttributeSet { colours: true, classes: true, ..AttributeSet::NONE });
            scan.points_in_sensor
                .push_with(first_points[0], 0.0, colour, class, voxtile::scan::NO_TIME)
                .unwrap();
            fingerprint_of(&scan).scan_text()
        };
        let mut painted = [
            fingerprints[0].clone(),
            painted(None, None),
            painted(Some([0; 3]), None),
            painted(Some([1, 0, 0]), None),
            painted(None, Some(0)),
        ];
        painted.sort();
        assert!(painted.windows(2).all(|pair| pair[0] != pair[1]), "{painted:?}");

        let mut unread = chain_of(&scans()[..1]);
        unread.add_unread();
        assert_ne!(unread, first);
        assert_eq!(ScanChain::from_texts(0, "0g", ""), None);
    }
}
