use voxtile::mapper::{KeptScan, MapReader};
use voxtile::scan::{PointFrame, ScanPoints};
use voxtile::{Digest, Result};

/// Describes the digest, so that a digest of other data never equals one.
const CONTEXT: &str = "voxtile 1 kept scans";

/// Returns the digest of the scans that a map keeps, in order: equal for the same scans, whatever segments and numbers
/// they have. It covers the points of each scan with their intensities, colours, classes, times and marks, its pose or origin,
/// its motion and mount, and its time stamp. `docs/format.md` specifies the bytes.
///
/// # Errors
///
/// A map that keeps no scans, a damaged one, or an I/O error.
pub fn scan_digest(map: &MapReader) -> Result<Digest> {
    let mut hasher = blake3::Hasher::new_derive_key(CONTEXT);
    for scan in map.kept_scans()? {
        hash_scan(&scan?, &mut hasher)?;
    }
    Ok(Digest::from_bytes(hasher.finalize().into()))
}

fn hash_scan(scan: &KeptScan, hasher: &mut blake3::Hasher) -> Result<()> {
    // A hash for each list, because points come in chunks of any length.
    let mut lists: [blake3::Hasher; 4] = Default::default();
    let mut bytes = Vec::new();
    let mut of_times = blake3::Hasher::new();
    let (range, frame) = (0..scan.len(), PointFrame::Raw);
    scan.for_each_attributed_chunk(range, frame, &mut |points, intensities, attributes| {
        let [of_points, of_intensities, of_colours, of_classes] = &mut lists;
        let mut update = |list: &mut blake3::Hasher, fill: &dyn Fn(&mut Vec<u8>)| {
            bytes.clear();
            fill(&mut bytes);
            list.update(&bytes);
        };
        update(of_points, &|out| {
            out.extend(points.as_flattened().iter().flat_map(|value| value.to_le_bytes()))
        });
        update(&mut of_times, &|out| {
            out.extend(attributes.times_ns.iter().flat_map(|time| time.to_le_bytes()));
        });
        update(of_intensities, &|out| {
            out.extend(intensities.into_iter().flatten().flat_map(|value| value.to_le_bytes()));
        });
        update(of_colours, &|out| {
            out.extend(attributes.colours.iter().flat_map(|colour| match colour {
                Some([red, green, blue]) => [1, *red, *green, *blue],
                None => [0; 4],
            }));
        });
        update(of_classes, &|out| {
            out.extend(
                attributes.classes.iter().flat_map(|class| [class.is_some().into(), class.unwrap_or(0)]),
            );
        });
        true
    })?;
    hasher.update(&(scan.len() as u64).to_le_bytes());
    let (kind, numbers): (u8, Vec<f64>) = match scan.world_from_sensor() {
        Some(pose) => (1, [&pose.position_m()[..], &pose.quaternion()].concat()),
        None => (0, scan.origin().to_vec()),
    };
    hasher.update(&[kind]);
    numbers.iter().for_each(|number| {
        hasher.update(&number.to_le_bytes());
    });
    hasher.update(&[scan.stamp_ns().is_some().into()]);
    hasher.update(&scan.stamp_ns().unwrap_or(0).to_le_bytes());
    lists.iter().for_each(|list| {
        hasher.update(list.finalize().as_bytes());
    });
    let marks: Vec<u8> = scan.moving().into_iter().flat_map(|marks| marks.iter()).map(u8::from).collect();
    hasher.update(blake3::hash(&marks).as_bytes());
    if let Some(sweep) = scan.sweep() {
        let mut bytes = Vec::new();
        sweep.write(&mut bytes);
        hasher.update(blake3::hash(&bytes).as_bytes());
        hasher.update(of_times.finalize().as_bytes());
    }
    if let Some(mount) = scan.body_from_sensor() {
        mount.iter().for_each(|number| {
            hasher.update(&number.to_le_bytes());
        });
    }
    Ok(())
}
