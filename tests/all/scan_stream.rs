use std::path::Path;
use tempfile::TempDir;
use voxtile::{Error, PointAttributes, Pose, Scan};
use voxtile_formats::{ReadOptions, ScanSource, ScanStreamWriter, SensorScan, open_scans, read_scan_stream};
use voxtile_simulation::Survey;

fn sensor_scan(number: u32) -> SensorScan {
    let point = |k: u32| [f64::from(k) * 0.25, -1.5, f64::from(number)];
    SensorScan {
        name: number.to_string(),
        points_in_sensor: (0..number).map(point).collect(),
        intensities: Some((0..number).map(|k| k as f32).collect()),
        attributes: PointAttributes::default(),
        world_from_sensor: Pose::from_quaternion([6_378_137.0, -2.0, 0.1], [0.5, -0.5, 0.5, 0.5]).unwrap(),
    }
}

fn written(label: &str, has_intensities: bool, scans: &[SensorScan]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ScanStreamWriter::new(&mut bytes, label, has_intensities).unwrap();
    scans.iter().for_each(|scan| writer.write(scan).unwrap());
    writer.flush().unwrap();
    bytes
}

fn read(bytes: &[u8]) -> voxtile::Result<Vec<SensorScan>> {
    let mut source = read_scan_stream(bytes, Path::new("standard input"), false)?;
    let mut scans = Vec::new();
    while let Some(scan) = source.next_scan()? {
        scans.push(scan);
    }
    Ok(scans)
}

fn assert_same(a: &SensorScan, b: &SensorScan) {
    assert_eq!((&a.points_in_sensor, &a.intensities), (&b.points_in_sensor, &b.intensities));
    assert_eq!(a.world_from_sensor, b.world_from_sensor);
}

#[test]
fn written_scans_are_read_back() {
    let scans: Vec<_> = [3, 0, 5].map(sensor_scan).to_vec();
    let found = read(&written("three", true, &scans)).unwrap();
    assert_eq!(found.len(), 3);
    found.iter().zip(&scans).for_each(|(found, scan)| assert_same(found, scan));
    let bare = read(&written("three", false, &scans)).unwrap();
    for (found, scan) in bare.iter().zip(&scans) {
        assert_same(found, &SensorScan { intensities: None, ..scan.clone() });
    }
    assert!(read(&written("", true, &[])).unwrap().is_empty());
}

#[test]
fn scans_in_the_world_frame_are_exact_at_any_distance() {
    let scan = Survey::tour(1, 500).next().unwrap();
    for shift_m in [0.0, 6.4e6] {
        let scan: Scan = scan.clone().translated([shift_m; 3]);
        let mut bytes = Vec::new();
        ScanStreamWriter::new(&mut bytes, "", true).unwrap().write_world(&scan).unwrap();
        let found = read(&bytes).unwrap().remove(0).into_scan();
        assert_eq!((found.origin, &found.intensities), (scan.origin, &scan.intensities));
        for (a, b) in found.points.iter().zip(&scan.points) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-5), "{a:?} {b:?}");
        }
    }
}

#[test]
fn truncated_and_invalid_streams_are_errors_with_an_offset() {
    let bytes = written("label", true, &[sensor_scan(2)]);
    let header = written("label", true, &[]).len();
    for end in (0..bytes.len()).filter(|&end| end != header) {
        let error = read(&bytes[..end]).unwrap_err();
        assert!(matches!(error, Error::Malformed { .. }), "{end}: {error:#}");
    }
    let nan = f64::NAN.to_le_bytes();
    for (at, patch) in
        [(0, &b"X"[..]), (8, &[2]), (12, &[9]), (16, &[255, 255]), (20, &[255]), (header + 4, &nan)]
    {
        let mut wrong = bytes.clone();
        wrong[at..at + patch.len()].copy_from_slice(patch);
        let error = read(&wrong).unwrap_err();
        assert!(matches!(error, Error::Malformed { .. }), "{at}: {error:#}");
    }
    // A quaternion of length 0.
    let mut wrong = bytes.clone();
    wrong[header + 28..header + 60].fill(0);
    assert!(read(&wrong).is_err());
    // An impossible count must not allocate memory.
    let mut wrong = bytes;
    wrong[header..header + 4].fill(255);
    assert!(read(&wrong).is_err());
}

/// For any number of skipped scans, and any truncated or damaged file: the result equals that of reading every scan.
#[test]
fn skipped_scans_are_checked_like_scans_that_are_read() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("drive.scans");
    for has_intensities in [true, false] {
        let bytes = written("label", has_intensities, &[3, 0, 2, 5, 1].map(sensor_scan));
        let nan = f64::NAN.to_le_bytes();
        let pose_of_second = written("label", has_intensities, &[sensor_scan(3)]).len() + 4;
        let mut wrong = bytes.clone();
        wrong[pose_of_second..pose_of_second + 8].copy_from_slice(&nan);
        let cut = (30..bytes.len()).map(|end| bytes[..end].to_vec());
        for bytes in cut.chain([bytes.clone(), wrong]) {
            std::fs::write(&path, &bytes).unwrap();
            for skipped in 0..7 {
                let stream = || read_scan_stream(&*bytes, &path, true).unwrap();
                let naive = skip_and_read(&mut stream(), skipped, |source| {
                    Ok(usize::from(source.next_scan()?.is_some()))
                });
                let piped = skip_and_read(&mut stream(), skipped, |source| source.skip(1));
                let mut of_file = open_scans(&path, &ReadOptions::default()).unwrap();
                let of_file = skip_and_read(&mut *of_file, skipped, |source| source.skip(1));
                assert_eq!(naive, piped, "{} bytes, {skipped} skipped", bytes.len());
                assert_eq!(naive, of_file, "{} bytes, {skipped} skipped", bytes.len());
            }
        }
    }
}

/// Returns the scans read after so many skipped ones, and the errors. Unreadable scans are passed over.
fn skip_and_read(
    source: &mut dyn ScanSource,
    scans: usize,
    skip: impl Fn(&mut dyn ScanSource) -> voxtile::Result<usize>,
) -> (Vec<String>, Vec<String>) {
    let (mut found, mut errors) = (Vec::new(), Vec::new());
    for number in 0.. {
        let next = match number < scans {
            true => skip(source).map(|skipped| (skipped > 0).then(|| "skipped".to_owned())),
            false => source.next_scan().map(|scan| scan.map(|scan| format!("{scan:?}"))),
        };
        match next {
            Ok(Some(scan)) => found.push(scan),
            Ok(None) => break,
            Err(error) => {
                errors.push(format!("{error:#}"));
                if !source.pass_unread() {
                    break;
                }
            }
        }
    }
    (found, errors)
}

#[test]
fn missing_intensities_and_long_labels_are_errors() {
    let mut writer = ScanStreamWriter::new(Vec::new(), "", true).unwrap();
    assert!(writer.write(&SensorScan { intensities: None, ..sensor_scan(1) }).is_err());
    assert!(ScanStreamWriter::new(Vec::new(), &"x".repeat(5000), true).is_err());
}

#[test]
fn streams_are_identified_by_label_and_files_by_content() {
    let source = |label: &str| {
        let bytes = written(label, true, &[sensor_scan(2)]);
        read_scan_stream(std::io::Cursor::new(bytes), Path::new("-"), false).unwrap().fingerprint()
    };
    assert_eq!(source("drive 1").unwrap(), "stream \"drive 1\"");
    assert!(matches!(source(""), Err(Error::InvalidArgument { .. })));

    let folder = TempDir::new().unwrap();
    let path = folder.path().join("drive.scans");
    std::fs::write(&path, written("", true, &[sensor_scan(2)])).unwrap();
    let mut file = open_scans(&path, &ReadOptions::default()).unwrap();
    assert!(file.fingerprint().unwrap().starts_with("1 file, "));
    assert_same(&file.next_scan().unwrap().unwrap(), &sensor_scan(2));
    assert!(
        open_scans(&path, &ReadOptions { poses: Some("poses.txt".into()), ..ReadOptions::default() })
            .is_err()
    );
}
