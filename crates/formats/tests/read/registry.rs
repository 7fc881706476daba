//! Tests that a format needs only one registry row and one file, and that all lists of formats agree with the registry.

use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use voxtile::{Error, FormatError, Result};
use voxtile_formats::read::{Points, Visit};
use voxtile_formats::{CloudHead, CloudPoint};
use voxtile_formats::{Detection, InputFormat, Open, ReadOptions, Registry};

/// Points on the x axis, one per line.
struct Axis(BufReader<fs::File>);

impl Points for Axis {
    fn read(&mut self, visit: Visit<'_>) -> Result<()> {
        for (number, line) in (1..).zip((&mut self.0).lines().skip(1)) {
            let line = line.map_err(|error| Error::io(Path::new("axis"), "read", error))?;
            let wrong = |_| FormatError::at_line(number + 1, "no number").in_input(Path::new("axis"));
            visit(CloudPoint::hit([line.parse().map_err(wrong)?, 0.0, 0.0]))?;
        }
        Ok(())
    }
}

fn open_axis(path: &Path, head: CloudHead, _: &ReadOptions) -> Result<(CloudHead, Box<dyn Points>)> {
    let file = fs::File::open(path).map_err(|error| Error::io(path, "read", error))?;
    Ok((head, Box::new(Axis(BufReader::new(file)))))
}

const AXIS: InputFormat = InputFormat {
    name: "axis",
    aliases: &["line"],
    title: "points on an axis",
    extensions: &["axis"],
    detection: Detection::Start(|start| start.starts_with(b"AXIS\n")),
    open: Open::Cloud(open_axis),
    ..InputFormat::UNNAMED
};

#[test]
fn formats_need_one_row_and_one_file() {
    let folder = tempfile::tempdir().unwrap();
    let scans = folder.path().join("drive/scans");
    fs::create_dir_all(&scans).unwrap();
    fs::write(folder.path().join("drive/poses_tum.txt"), "0 7 0 0 0 0 0 1\n1 8 0 0 0 0 0 1\n").unwrap();
    for (name, text) in [("10.axis", "AXIS\n3\n"), ("9.axis", "AXIS\n1.5\n-2\n")] {
        fs::write(scans.join(name), text).unwrap();
    }
    let formats = Registry::default().with(AXIS);
    for format in [None, Some("axis".to_owned()), Some("LINE".to_owned())] {
        let options = ReadOptions { format, ..ReadOptions::default() };
        let mut source = formats.open_scans(&folder.path().join("drive"), &options).unwrap();
        assert_eq!((source.len_hint(), source.format().as_str()), (Some(2), "points on an axis, a folder"));
        let first = source.next_scan().unwrap().unwrap();
        assert_eq!((first.name.as_str(), first.points_in_sensor.len()), ("9.axis", 2));
        assert_eq!(first.world_from_sensor.position_m(), [7.0, 0.0, 0.0]);
        let second = source.next_scan().unwrap().unwrap();
        assert_eq!(second.points_in_sensor, [[3.0, 0.0, 0.0]]);
        assert!(source.next_scan().unwrap().is_none());
    }
    // The format is detected from the content, whatever the name. Without its row it is unknown.
    let renamed = folder.path().join("cloud.dat");
    fs::write(&renamed, "AXIS\nx\n").unwrap();
    let error = match formats.open_scans(&renamed, &ReadOptions::default()).unwrap().next_scan() {
        Err(error) => format!("{error:#}"),
        Ok(scan) => panic!("{scan:?}"),
    };
    assert!(error.contains("line 2: no number"), "{error}");
    let error = Registry::default().guess(&renamed, &[]).unwrap_err().to_string();
    assert!(error.contains("known formats: pcd, ply") && !error.contains("axis"), "{error}");
    fs::write(folder.path().join("bad.axis"), "nothing").unwrap();
    let error = formats.guess(&folder.path().join("bad.axis"), &[]).unwrap_err().to_string();
    assert!(error.contains("has the extension .axis, but its content is not of that format"), "{error}");
}

#[test]
fn names_are_unique_and_rows_are_complete() {
    let formats = Registry::default();
    let mut names = BTreeSet::new();
    for format in formats.formats() {
        for name in [format.name].iter().chain(format.aliases) {
            assert!(names.insert(*name), "{name}");
            assert_eq!(formats.named(name).unwrap().name, format.name);
        }
        assert!(!format.title.is_empty(), "{}", format.name);
        let lower = |extension: &&str| {
            extension.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit())
        };
        assert!(format.extensions.iter().all(lower), "{}", format.name);
    }
}

fn repository(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Checks the table of `docs/formats.md` and the names in Python's help.
#[test]
fn documents_list_all_formats() {
    let formats = Registry::default();
    let names: BTreeSet<&str> = formats.formats().iter().map(|format| format.name).collect();
    let page = repository("docs/formats.md");
    let table = page.split("## In").nth(1).unwrap().split("\n\n").nth(1).unwrap();
    let listed: BTreeSet<&str> = (table.lines().skip(2))
        .flat_map(|row| row.split('|').nth(1).unwrap().split('`').skip(1).step_by(2))
        .filter(|name| !name.starts_with('.'))
        .collect();
    assert_eq!(listed, names);
    let help = repository("python/python/voxtile/files.py").split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        help.contains(&format!("does not identify it: {}", formats.names(" "))),
        "{}",
        formats.names(" ")
    );
}
