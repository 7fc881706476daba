use crate::made::voxels::{format_of, write_voxels};
use std::fs;
use std::path::Path;
use voxtile_formats::CloudSource;
use voxtile_formats::write::{VoxelsHead, WriteOptions};
use voxtile_formats::{ReadOptions, open_clouds};

const FORMATS: [&str; 4] = ["las", "laz", "copc", "e57"];
const UTM: &str = "PROJCS[\"WGS 84 / UTM zone 32N\",GEOGCS[\"WGS 84\",DATUM[\"WGS_1984\",SPHEROID[\"WGS 84\",6378137,\
                   298.257223563]],PRIMEM[\"Greenwich\",0],UNIT[\"degree\",0.0174532925199433]],\
                   PROJECTION[\"Transverse_Mercator\"],UNIT[\"metre\",1],AUTHORITY[\"EPSG\",\"32632\"]]";

/// Writes and reads a coordinate system. Returns the one read and the remarks.
fn round_trip(format: &str, crs: Option<&str>) -> (Option<String>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(format!("a.{}", format_of(format).extension.unwrap()));
    write_voxels(format, &path, crs);
    if format != "e57" {
        let bytes = fs::read(&path).unwrap();
        // Point format 6 requires the WKT bit, even without a coordinate system.
        assert_eq!(bytes[6] & 1 << 4, 1 << 4, "{format}");
    }
    // The given origin avoids a remark on the missing pose of an E57 scan.
    let options = ReadOptions { sensor_origin_m: Some([0.0; 3]), ..ReadOptions::default() };
    let source = open_clouds(&path, &options).unwrap();
    (source.crs().map(str::to_owned), source.remarks())
}

#[test]
fn text_and_codes_round_trip() {
    for format in FORMATS {
        for crs in [None, Some(UTM), Some("EPSG:25832")] {
            assert_eq!(round_trip(format, crs), (crs.map(str::to_owned), vec![]), "{format}");
        }
    }
}

#[test]
fn coordinate_systems_in_feet_are_not_passed_on() {
    let feet = UTM.replace("UNIT[\"metre\",1]", "UNIT[\"US survey foot\",0.304800609601219]");
    for format in FORMATS {
        let (crs, remarks) = round_trip(format, Some(&feet));
        let expected = "the coordinate system is not in metres";
        assert!(
            crs.is_none() && remarks.iter().any(|remark| remark.starts_with(expected)),
            "{format}: {remarks:?}"
        );
    }
}

#[test]
fn invalid_epsg_codes_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    let head = VoxelsHead::of_stream(0, 0.5);
    for crs in ["EPSG:", "EPSG:100000", "EPSG:4326+5773"] {
        let options = WriteOptions { crs: Some(crs.to_owned()), ..WriteOptions::for_path(&path) };
        let error = format_of("las").open(&head, &path, &options).err().unwrap();
        assert!(format!("{error:#}").contains(crs), "{error}");
    }
}

/// Opens a folder of files, each with its own coordinate system.
fn folder_of(folder: &Path, format: &str, systems: &[Option<&str>]) -> Box<dyn CloudSource> {
    for (number, crs) in systems.iter().enumerate() {
        let path = folder.join(format!("{number}.{}", format_of(format).extension.unwrap()));
        write_voxels(format, &path, *crs);
    }
    open_clouds(folder, &ReadOptions::default()).unwrap()
}

fn of_systems(source: &dyn CloudSource) -> Vec<String> {
    source.remarks().into_iter().filter(|remark| remark.contains("coordinate system")).collect()
}

#[test]
fn files_with_another_coordinate_system_are_refused() {
    for format in ["las", "e57"] {
        let folder = tempfile::tempdir().unwrap();
        let systems = [Some("EPSG:25832"), Some("EPSG:25833"), None, Some("EPSG:25832")];
        let mut source = folder_of(folder.path(), format, &systems);
        let (mut clouds, mut errors) = (0, Vec::new());
        loop {
            match source.next_cloud() {
                Ok(Some(_)) => clouds += 1,
                Ok(None) => break,
                Err(error) => errors.push(format!("{error:#}")),
            }
        }
        assert_eq!((clouds, errors.len()), (3, 1), "{format}: {errors:?}");
        let parts = ["/1.", "in EPSG:25833, but those of the previous files are in EPSG:25832"];
        assert!(parts.iter().all(|part| errors[0].contains(part)), "{errors:?}");
        assert_eq!((source.crs(), of_systems(&*source)), (Some("EPSG:25832"), vec![]));
    }
}

#[test]
fn coordinate_system_of_later_files_is_remarked() {
    let folder = tempfile::tempdir().unwrap();
    let mut source = folder_of(folder.path(), "las", &[None, Some("EPSG:25832")]);
    assert!(source.next_cloud().unwrap().is_some());
    assert_eq!((source.crs(), of_systems(&*source)), (None, vec![]));
    assert!(source.next_cloud().unwrap().is_some());
    assert_eq!(source.crs(), Some("EPSG:25832"));
    let remarks = of_systems(&*source);
    let expected = "1.las: names the coordinate system EPSG:25832, but the previous files name none";
    assert!(remarks.len() == 1 && remarks[0].starts_with(expected), "{remarks:?}");
}
