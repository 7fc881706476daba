use crate::support::rows_of;
use std::fs;
use std::path::{Path, PathBuf};
use voxtile::scan::{AttributeSet, PointAttributes, PointFrame, ScanPoints};
use voxtile_formats::{
    ClassSelection, PointBudget, ReadOptions, Returns, ScanStreamWriter, Selection, SensorScan, open_scans,
};

/// A point with its attributes.
pub type Row = ([f64; 3], Option<[u8; 3]>, Option<u8>);

pub const BOTH: AttributeSet = AttributeSet { colours: true, classes: true, ..AttributeSet::NONE };

/// More points than are in memory or in a chunk of the file.
const ROWS: usize = 17_000;

pub fn options(attributes: AttributeSet) -> ReadOptions {
    ReadOptions { attributes, poses: Some("identity".into()), ..ReadOptions::default() }
}

/// Returns the points of all scans, and the remarks at the end.
pub fn scanned(
    path: &Path,
    options: &ReadOptions,
    max_bytes: usize,
) -> Result<(Vec<Row>, Vec<String>), String> {
    let scratch = tempfile::tempdir().unwrap();
    let budget = PointBudget::new(max_bytes, scratch.path());
    let mut source = open_scans(path, options).map_err(|error| format!("{error:#}"))?;
    let mut rows = Vec::new();
    while let Some(scan) = source.next_stored(&budget).map_err(|error| format!("{error:#}"))? {
        let set = scan.attributes();
        scan.for_each_attributed_chunk(0..scan.len(), PointFrame::World, &mut |points, _, attributes| {
            assert_eq!(attributes.colours.len(), if set.colours { points.len() } else { 0 });
            assert_eq!(attributes.classes.len(), if set.classes { points.len() } else { 0 });
            let row = |(at, point): (usize, &[f64; 3])| (*point, attributes.colour(at), attributes.class(at));
            rows.extend(points.iter().enumerate().map(row));
            true
        })
        .unwrap();
    }
    Ok((rows, source.remarks()))
}

/// Checks that a file gives these points with any budget, and those of other requests.
fn assert_rows(path: &Path, wanted: &[Row]) {
    for max_bytes in [0, usize::MAX] {
        let (found, remarks) = scanned(path, &options(BOTH), max_bytes).unwrap();
        assert!(found == wanted, "{}: {max_bytes}", path.display());
        assert_eq!(remarks, [""; 0], "{}", path.display());
    }
    let colours = AttributeSet { colours: true, ..AttributeSet::NONE };
    let only: Vec<Row> = wanted.iter().map(|(point, colour, _)| (*point, *colour, None)).collect();
    assert!(scanned(path, &options(colours), 0).unwrap().0 == only);
    let none: Vec<Row> = wanted.iter().map(|(point, ..)| (*point, None, None)).collect();
    assert!(scanned(path, &options(AttributeSet::NONE), 0).unwrap().0 == none);
    // Selection by class needs no layer.
    for (only_class, skip_class) in [(vec![1, 2, 3], vec![]), (vec![], vec![0, 7, 18]), (vec![5, 7], vec![7])]
    {
        let classes = ClassSelection { only_class, skip_class };
        let selected: Vec<Row> = wanted.iter().filter(|row| classes.takes(row.2)).copied().collect();
        assert!(!selected.is_empty() && selected.len() < wanted.len());
        let selecting = ReadOptions { classes: classes.clone(), ..options(BOTH) };
        let (found, remarks) = scanned(path, &selecting, 0).unwrap();
        assert!(found == selected, "{classes:?}");
        let left_out = wanted.len() - selected.len();
        assert_eq!(remarks, [format!("{left_out} points were left out by their class")]);
        let found = scanned(path, &ReadOptions { attributes: AttributeSet::NONE, ..selecting }, 0).unwrap().0;
        assert!(found.iter().zip(&selected).all(|(a, b)| a.0 == b.0 && (a.1, a.2) == (None, None)));
    }
    // Ignored points.
    let mut selection = Selection::default();
    selection.ignored = Some(voxtile::space::Aabb { min: [-1e9; 3], max: [0.0, 1e9, 1e9] });
    let kept: Vec<Row> = wanted.iter().filter(|(point, ..)| point[0] > 0.0).copied().collect();
    let found = scanned(path, &ReadOptions { selection, ..options(BOTH) }, 0).unwrap().0;
    assert!(!kept.is_empty() && found == kept);
}

fn write(folder: &Path, name: &str, parts: &[&[u8]]) -> PathBuf {
    let path = folder.join(name);
    fs::write(&path, parts.concat()).unwrap();
    path
}

fn floats(point: [f64; 3]) -> Vec<u8> {
    point.iter().flat_map(|axis| (*axis as f32).to_le_bytes()).collect()
}

fn bits_of(colour: Option<[u8; 3]>, alpha: u8) -> u32 {
    let [red, green, blue] = colour.unwrap_or_default();
    u32::from_be_bytes([alpha, red, green, blue])
}

/// Compresses by literal runs only.
fn lzf(bytes: &[u8]) -> Vec<u8> {
    bytes.chunks(32).flat_map(|run| [&[run.len() as u8 - 1][..], run].concat()).collect()
}

#[test]
fn pcd_files_give_colours_and_classes() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(ROWS);
    let head = |kind: &str, name: &str, data: &str| {
        format!(
            "VERSION 0.7\nFIELDS x y z {name} label\nSIZE 4 4 4 4 2\nTYPE F F F {kind} U\nCOUNT 1 1 1 1 1\n\
             WIDTH {ROWS}\nHEIGHT 1\nPOINTS {ROWS}\nDATA {data}\n"
        )
    };
    let class = |row: &Row| u16::from(row.2.unwrap());
    // With an alpha of 255, the bits of many colours are a float of NaN.
    for (kind, name, alpha) in [("F", "rgb", 0), ("F", "rgb", 255), ("U", "rgba", 255), ("I", "rgb", 7)] {
        let bits = |row: &Row| bits_of(row.1, alpha);
        let record = |row: &Row| {
            [floats(row.0), bits(row).to_le_bytes().to_vec(), class(row).to_le_bytes().to_vec()].concat()
        };
        let binary: Vec<u8> = rows.iter().flat_map(record).collect();
        assert_rows(&write(folder.path(), "b.pcd", &[head(kind, name, "binary").as_bytes(), &binary]), &rows);
        let mut columns: Vec<u8> = Vec::new();
        for axis in 0..3 {
            columns.extend(rows.iter().flat_map(|row| (row.0[axis] as f32).to_le_bytes()));
        }
        columns.extend(rows.iter().flat_map(|row| bits(row).to_le_bytes()));
        columns.extend(rows.iter().flat_map(|row| class(row).to_le_bytes()));
        let packed = lzf(&columns);
        let sizes = [(packed.len() as u32).to_le_bytes(), (columns.len() as u32).to_le_bytes()].concat();
        let start = head(kind, name, "binary_compressed");
        assert_rows(&write(folder.path(), "c.pcd", &[start.as_bytes(), &sizes, &packed]), &rows);
        let text: String = rows
            .iter()
            .map(|row| {
                let ([x, y, z], bits, class) = (row.0, bits(row), class(row));
                // As a float, or as PCL writes it: as an integer.
                match (kind, alpha) {
                    ("F", 0) => format!("{x} {y} {z} {:e} {class}\n", f32::from_bits(bits)),
                    _ => format!("{x} {y} {z} {bits} {class}\n"),
                }
            })
            .collect();
        let start = head(kind, name, "ascii");
        assert_rows(&write(folder.path(), "a.pcd", &[start.as_bytes(), text.as_bytes()]), &rows);
    }
}

#[test]
fn ply_files_give_colours_and_classes() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(ROWS);
    let head = |format: &str, kind: &str, names: [&str; 3], class: &str| {
        let [red, green, blue] = names.map(|name| format!("property {kind} {name}\n"));
        format!(
            "ply\nformat {format} 1.0\nelement vertex {ROWS}\nproperty float x\nproperty float y\n\
             property float z\n{red}{green}{blue}property uchar {class}\nend_header\n"
        )
    };
    for (kind, names, class) in [
        ("uchar", ["red", "green", "blue"], "label"),
        ("uint", ["r", "g", "b"], "class"),
        ("ushort", ["diffuse_red", "diffuse_green", "diffuse_blue"], "scalar_Classification"),
        ("float", ["Red", "Green", "Blue"], "classification"),
    ] {
        let value = |channel: u8| match kind {
            "ushort" => format!("{}", u16::from(channel) * 256 + 200),
            "float" => format!("{}", f32::from(channel) / 255.0),
            _ => format!("{channel}"),
        };
        let bytes = |channel: u8| match kind {
            "uchar" => vec![channel],
            "uint" => u32::from(channel).to_le_bytes().to_vec(),
            "ushort" => (u16::from(channel) * 256 + 200).to_le_bytes().to_vec(),
            _ => (f32::from(channel) / 255.0).to_le_bytes().to_vec(),
        };
        let (mut binary, mut text) = (Vec::new(), String::new());
        for (point, colour, label) in &rows {
            let (colour, label, [x, y, z]) = (colour.unwrap(), label.unwrap(), *point);
            binary.extend(floats(*point));
            binary.extend(colour.iter().flat_map(|channel| bytes(*channel)));
            binary.push(label);
            text += &format!("{x} {y} {z} {} {label}\n", colour.map(value).join(" "));
        }
        let files = [
            write(
                folder.path(),
                "b.ply",
                &[head("binary_little_endian", kind, names, class).as_bytes(), &binary],
            ),
            write(folder.path(), "a.ply", &[head("ascii", kind, names, class).as_bytes(), text.as_bytes()]),
        ];
        for path in files {
            if kind == "uchar" {
                assert_rows(&path, &rows);
                continue;
            }
            let (found, remarks) = scanned(&path, &options(BOTH), 0).unwrap();
            assert!(found == rows, "{kind}");
            let is_guessed = remarks.iter().any(|remark| remark.contains("from 0 to 1"));
            assert_eq!((remarks.len(), is_guessed), (usize::from(kind == "float"), kind == "float"));
        }
    }
}

#[test]
fn named_columns_of_texts_are_colours_and_classes() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(ROWS);
    for (name, head, separator) in
        [("a.csv", "x,y,z,R,G,B,class", ","), ("a.txt", "//X Y Z red green blue scalar_Label", " ")]
    {
        let mut text = format!("{head}\n");
        for ([x, y, z], colour, class) in &rows {
            let [red, green, blue] = colour.unwrap();
            let cells = [red, green, blue, class.unwrap()].map(|cell| cell.to_string());
            text += &([x, y, z].map(f64::to_string).to_vec().join(separator) + separator);
            text += &(cells.join(separator) + "\n");
        }
        let (found, remarks) =
            scanned(&write(folder.path(), name, &[text.as_bytes()]), &options(BOTH), 0).unwrap();
        assert!(found == rows && remarks[0].contains("from 0 to 255"), "{remarks:?}");
    }
    let read =
        |text: &str| scanned(&write(folder.path(), "b.csv", &[text.as_bytes()]), &options(BOTH), 0).unwrap();
    let (found, remarks) = read("x,y,z,r,g,b\n1,2,3,0,0,0\n1,2,3,1,0.5,0\n1,2,3,,,\n1,2,3,2,0,0\n");
    let colours: Vec<_> = found.iter().map(|row| row.1).collect();
    assert_eq!(colours, [Some([0; 3]), Some([255, 128, 0]), None, None]);
    assert!(
        remarks[0].contains("from 0 to 1") && remarks[1].starts_with("1 points have a colour"),
        "{remarks:?}"
    );
    // Words are no classes; unnamed columns are no colours.
    let (found, remarks) = read("x,y,z,label\n1,2,3,building\n");
    assert!(found[0].2.is_none() && remarks[0].contains("`label` has no numbers"), "{remarks:?}");
    assert_eq!(read("1,2,3,255,0,0\n").0, [([1.0, 2.0, 3.0], None, None)]);
}

#[test]
fn semantic_kitti_labels_are_classes() {
    let outer = tempfile::tempdir().unwrap();
    let rows: Vec<Row> = rows_of(ROWS).iter().map(|(point, _, class)| (*point, None, *class)).collect();
    let [velodyne, labels] = ["velodyne", "labels"].map(|name| {
        fs::create_dir(outer.path().join(name)).unwrap();
        outer.path().join(name)
    });
    let points: Vec<u8> =
        rows.iter().flat_map(|row| [floats(row.0), 0.5_f32.to_le_bytes().to_vec()].concat()).collect();
    let scan = write(&velodyne, "000000.bin", &[&points]);
    // The upper half is the number of an object.
    let label = |row: &Row| (u32::from(row.2.unwrap()) | 0x0503_0000).to_le_bytes();
    let classes: Vec<u8> = rows.iter().flat_map(label).collect();
    let file = write(&labels, "000000.label", &[&classes]);
    let fields = Some(["x", "y", "z", "intensity"].map(str::to_owned).to_vec());
    let reading = ReadOptions { fields, ..options(BOTH) };
    for path in [&scan, &velodyne] {
        assert!(scanned(path, &reading, 0).unwrap().0 == rows);
    }
    let selecting = ClassSelection { only_class: vec![3], ..ClassSelection::default() };
    let selecting = ReadOptions { classes: selecting, attributes: AttributeSet::NONE, ..reading.clone() };
    let wanted = rows.iter().filter(|row| row.2 == Some(3)).count();
    assert_eq!(scanned(&scan, &selecting, 0).unwrap().0.len(), wanted);
    // Moving objects have numbers beyond 255.
    let moving: Vec<u8> = (0..ROWS).flat_map(|k| (252 + (k % 8) as u32).to_le_bytes()).collect();
    fs::write(&file, &moving).unwrap();
    let (found, remarks) = scanned(&scan, &reading, 0).unwrap();
    assert_eq!([found[3].2, found[4].2], [Some(255), None]);
    assert!(remarks.iter().any(|remark| remark.starts_with(&format!("{} points", ROWS / 2))), "{remarks:?}");
    fs::write(&file, &moving[4..]).unwrap();
    let error = scanned(&scan, &reading, 0).unwrap_err();
    assert!(error.contains("000000.label: malformed: ") && error.contains("another scan"), "{error}");
    // Without the layer, labels are not read.
    assert_eq!(
        scanned(&scan, &ReadOptions { attributes: AttributeSet::NONE, ..reading }, 0).unwrap().0.len(),
        ROWS
    );
}

#[cfg(feature = "e57")]
#[test]
fn e57_colours_are_scaled_by_their_limits() {
    use e57::{E57Writer, Record, RecordDataType, RecordName, RecordValue};
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.e57");
    let rows: Vec<Row> = rows_of(ROWS).iter().map(|(point, colour, _)| (*point, *colour, None)).collect();
    let types = [
        RecordDataType::Integer { min: 0, max: 255 },
        RecordDataType::Integer { min: 0, max: 65535 },
        RecordDataType::Single { min: Some(0.0), max: Some(1.0) },
    ];
    for (number, data_type) in types.into_iter().enumerate() {
        let mut file = E57Writer::from_file(&path, "guid").unwrap();
        let colours = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
        let colours = colours.map(|name| Record { name, data_type: data_type.clone() });
        let axes = [Record::CARTESIAN_X_F32, Record::CARTESIAN_Y_F32, Record::CARTESIAN_Z_F32];
        let mut cloud = file.add_pointcloud("guid", axes.into_iter().chain(colours).collect()).unwrap();
        for (point, colour, _) in &rows {
            let colour = colour.unwrap().map(|channel| match number {
                0 => RecordValue::Integer(i64::from(channel)),
                1 => RecordValue::Integer(i64::from(channel) * 257),
                _ => RecordValue::Single(f32::from(channel) / 255.0),
            });
            let point = point.map(|axis| RecordValue::Single(axis as f32));
            cloud.add_point(point.into_iter().chain(colour).collect()).unwrap();
        }
        cloud.finalize().unwrap();
        file.finalize().unwrap();
        let reading = ReadOptions { poses: None, ..options(BOTH) };
        let (found, remarks) = scanned(&path, &reading, 0).unwrap();
        assert!(found == rows, "{number}");
        assert_eq!(remarks.len(), 1, "{remarks:?}");
        let found = scanned(&path, &ReadOptions { attributes: AttributeSet::NONE, ..reading }, 0).unwrap().0;
        assert!(found.iter().all(|row| row.1.is_none()) && found.len() == ROWS);
    }
}

/// With poses, motion compensation and points without a return.
#[test]
fn attributes_remain_with_their_points() {
    let folder = tempfile::tempdir().unwrap();
    let rows = rows_of(100);
    let mut ply = "ply\nformat ascii 1.0\nelement vertex 100\nproperty float x\nproperty float y\n\
                   property float z\nproperty double t\nproperty uchar red\nproperty uchar green\n\
                   property uchar blue\nproperty uchar label\nend_header\n"
        .to_owned();
    for (k, ([x, y, z], colour, class)) in rows.iter().enumerate() {
        let ([red, green, blue], class) = (colour.unwrap(), class.unwrap());
        let x = if k % 7 == 0 { "nan".to_owned() } else { x.to_string() };
        ply += &format!("{x} {y} {z} {} {red} {green} {blue} {class}\n", 0.001 * k as f64);
    }
    write(folder.path(), "1700000000.0.ply", &[ply.as_bytes()]);
    let poses = "1699999999.9 0 0 0 0 0 0 1\n1700000000.2 30 0 0 0 0 1 0\n";
    let poses = Some(write(folder.path(), "poses.txt", &[poses.as_bytes()]));
    for (is_deskewed, is_world_frame, has_no_returns) in
        [(true, false, true), (true, false, false), (false, true, true), (false, false, false)]
    {
        let mut given = ReadOptions { poses: poses.clone(), ..options(BOTH) };
        given.clouds.is_deskewed = is_deskewed;
        given.clouds.is_world_frame = is_world_frame;
        given.clouds.has_no_returns = has_no_returns;
        let (found, remarks) = scanned(folder.path(), &given, 0).unwrap();
        assert!(
            found.iter().map(|row| (row.1, row.2)).eq(rows.iter().map(|row| (row.1, row.2))),
            "{remarks:?}"
        );
    }
}

#[test]
fn scan_streams_carry_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let mut rows = rows_of(ROWS);
    for (k, row) in rows.iter_mut().enumerate() {
        row.1 = row.1.filter(|_| k % 3 > 0);
        row.2 = row.2.filter(|_| k % 4 > 0);
    }
    let pose = voxtile::Pose::identity();
    let scan = SensorScan {
        name: String::new(),
        points_in_sensor: rows.iter().map(|row| row.0).collect(),
        intensities: None,
        attributes: PointAttributes {
            colours: rows.iter().map(|row| row.1).collect(),
            classes: rows.iter().map(|row| row.2).collect(),
            ..PointAttributes::default()
        },
        world_from_sensor: pose,
    };
    for has_intensities in [false, true] {
        let intensities = has_intensities.then(|| vec![0.25; ROWS]);
        let scan = SensorScan { intensities, ..scan.clone() };
        for (colours, classes) in [(true, true), (true, false), (false, true)] {
            let set = AttributeSet { colours, classes, ..AttributeSet::NONE };
            let mut bytes = Vec::new();
            let mut writer =
                ScanStreamWriter::with_attributes(&mut bytes, "a", has_intensities, set).unwrap();
            writer.write(&scan).unwrap();
            // A scan without attributes.
            writer.write(&SensorScan { attributes: PointAttributes::default(), ..scan.clone() }).unwrap();
            let path = write(folder.path(), "a.scans", &[&bytes]);
            let wanted: Vec<Row> = (rows.iter())
                .map(|row| (row.0, row.1.filter(|_| colours), row.2.filter(|_| classes)))
                .chain(rows.iter().map(|row| (row.0, None, None)))
                .collect();
            let reading = ReadOptions { poses: None, ..options(BOTH) };
            assert!(scanned(&path, &reading, 0).unwrap().0 == wanted);
            let none = ReadOptions { attributes: AttributeSet::NONE, ..reading.clone() };
            assert!(scanned(&path, &none, 0).unwrap().0.iter().all(|row| (row.1, row.2) == (None, None)));
            let skip_class = ClassSelection { skip_class: vec![7], ..ClassSelection::default() };
            let skipping = ReadOptions { classes: skip_class, ..none };
            let found = scanned(&path, &skipping, 0);
            if classes {
                let left = wanted.iter().filter(|row| row.2 != Some(7)).count();
                let (found, remarks) = found.unwrap();
                assert_eq!((found.len(), remarks.len()), (left, 1));
            } else {
                assert!(found.unwrap_err().contains("a.scans have no classes"));
            }
            let cut = bytes.len() - 1;
            let error =
                scanned(&write(folder.path(), "cut.scans", &[&bytes[..cut]]), &reading, 0).unwrap_err();
            assert!(error.contains("the stream ends in the attributes of a point"), "{error}");
        }
    }
}

#[test]
fn numbers_that_are_no_class_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let head = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                property int label\nend_header\n1 2 3 255\n1 2 3 256\n1 2 3 -1\n";
    let path = write(folder.path(), "a.ply", &[head.as_bytes()]);
    let (rows, remarks) = scanned(&path, &options(BOTH), 0).unwrap();
    assert_eq!(rows.iter().map(|row| row.2).collect::<Vec<_>>(), [Some(255), None, None]);
    assert!(remarks.len() == 1 && remarks[0].starts_with("2 points have a class number"), "{remarks:?}");
    assert!(remarks[0].contains("such as 256"), "{remarks:?}");
    // A point without a class is none of the wanted classes, and none of those to skip.
    let classes = ClassSelection { only_class: vec![255], ..ClassSelection::default() };
    assert_eq!(scanned(&path, &ReadOptions { classes, ..options(BOTH) }, 0).unwrap().0.len(), 1);
    let classes = ClassSelection { skip_class: vec![255], ..ClassSelection::default() };
    assert_eq!(scanned(&path, &ReadOptions { classes, ..options(BOTH) }, 0).unwrap().0.len(), 2);
}

#[test]
fn selections_without_effect_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
               end_header\n1 2 3\n";
    let pcd = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n";
    let classes = ClassSelection { only_class: vec![2], ..ClassSelection::default() };
    for (name, text) in [("a.ply", ply), ("a.pcd", pcd), ("a.log", "NODE 0 0 0 0 0 0\n1 2 3\n")] {
        let path = write(folder.path(), name, &[text.as_bytes()]);
        let mut given = ReadOptions { classes: classes.clone(), ..options(AttributeSet::NONE) };
        given.poses = given.poses.filter(|_| name != "a.log");
        let error = scanned(&path, &given, 0).unwrap_err();
        assert!(
            error.starts_with("only_class, skip_class: ") && error.contains("have no classes"),
            "{error}"
        );
        let given = ReadOptions { returns: Returns::Last, classes: ClassSelection::default(), ..given };
        let error = scanned(&path, &given, 0).unwrap_err();
        assert!(error.starts_with("returns: ") && error.contains(name), "{error}");
    }
}

#[test]
fn points_are_rounded_to_a_step() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.xyz");
    std::fs::write(&path, "0.1 0.37 -0.13\n2.5 -7.1 0.05\n0.01 0.02 0.03\n").unwrap();
    let mut options = ReadOptions { poses: Some("identity".into()), ..ReadOptions::default() };
    options.selection.step_m = Some(0.25);
    let mut source = open_scans(&path, &options).unwrap();
    let scan = source.next_scan().unwrap().unwrap();
    // The last one would become a point without a return.
    assert_eq!(scan.points_in_sensor, [[0.0, 0.25, -0.25], [2.5, -7.0, 0.0], [0.01, 0.02, 0.03]]);
    assert!(source.next_scan().unwrap().is_none());
    let remarks = source.remarks();
    assert!(remarks.iter().any(|remark| remark.contains("multiples of 0.25 m")), "{remarks:?}");
}
