use crate::support::{clouds, clouds_with, failure};
use std::fs;
use std::path::Path;
use voxtile_formats::{ReadOptions, Registry, open_clouds, open_scans};

/// Returns the points and the remarks of a file.
fn read(path: &Path, options: &ReadOptions) -> (Vec<[f64; 3]>, Vec<String>) {
    let mut source = open_clouds(path, options).unwrap_or_else(|error| panic!("{error:#}"));
    let clouds = crate::support::all(source.as_mut()).unwrap_or_else(|error| panic!("{error:#}"));
    let points = clouds.into_iter().flat_map(|(_, points)| points).map(|point| point.position_m);
    (points.collect(), source.remarks())
}

fn read_text(name: &str, text: &str) -> (Vec<[f64; 3]>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    read(&path, &ReadOptions::default())
}

fn error_of(name: &str, bytes: &[u8]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, bytes).unwrap();
    failure(&path, &ReadOptions::default()).0
}

const WANTED: [[f64; 3]; 2] = [[1.5, -2.25, 3.0], [4.0, 5.0, 6.0]];

#[test]
fn texts_of_many_programs_are_read() {
    for (name, text) in [
        ("mac.xyz", "1.5 -2.25 3\r4 5 6\r"),
        ("mark.csv", "\u{feff}x,y,z\r\n1.5,-2.25,3\r\n4,5,6\r\n"),
        ("cloudcompare.pts", "//X;Y;Z;Rf;Intensity\n2\n1.5;-2.25;3;1;0.5\n4;5;6;1;0.5\n"),
        (
            "livox.csv",
            "Version,Error Code,Timestamp,X,Y,Z,Tag\n5,0x0000,17,1.5,-2.25,3,0x10\n5,0x0000,18,4,5,6,0\n",
        ),
        (
            "veloview.csv",
            "\"laser_id\",\"Points_m_XYZ:0\",\"Points_m_XYZ:1\",\"Points_m_XYZ:2\"\n3,1.5,-2.25,3\n3,4,5,6\n",
        ),
        ("comma.csv", "x;y;z\n1,5;-2,25;3,0\n4;5;6\n"),
        ("comma.txt", "1,5\t-2,25\t3,0\n4\t5\t6\n"),
        ("cm.csv", "x (cm);y (cm);z (cm)\n150;-225;300\n400;500;600\n"),
        ("mm.csv", "X[mm],Y[mm],Z[mm]\n1500,-2250,3000\n4000,5000,6000\n"),
        ("bars.txt", "x|y|z|class\n1.5|-2.25|3|wall\n4|5|6|floor\n"),
        ("title.asc", "Scan of the hall\nX Y Z\n1.5 -2.25 3\n4 5 6\n"),
    ] {
        assert_eq!(read_text(name, text).0, WANTED, "{name}");
    }
}

#[test]
fn invalid_rows_are_counted_and_reported() {
    let (points, remarks) = read_text("a.csv", "x,y,z\n1.5,-2.25,3\nbroken,1,2\n4,5,6\n7,8\n");
    assert_eq!(points, WANTED);
    assert_eq!(remarks, ["2 rows are not points, skipped (line 3: `broken` is not a number)"]);
    let error = error_of("a.csv", b"x,y,z\nbroken,1,2\n");
    assert!(error.contains("line 2: `broken` is not a number"), "{error}");
    let (points, _) = read_text("nan.csv", "x,y,z\n1.5,-2.25,3\n,,\n1.#QNAN,-nan(ind),NA\n4,5,6\n");
    assert!(points.len() == 4 && points[1..3].iter().flatten().all(|value| value.is_nan()), "{points:?}");
}

#[test]
fn invalid_texts_are_errors_with_line_and_word() {
    for (name, bytes, reason) in [
        ("a.csv", &b"x (px),y (px),z (px)\n1,2,3\n"[..], "line 1: column `x (px)`: `px` is an unknown unit"),
        ("a.xyz", b"# a\nC 1 2 3\n", "line 2: `C 1 2 3` is neither numbers nor column names"),
        ("a.txt", b"1 2\n3 4\n", "line 1: 2 columns; a point needs x, y and z"),
        ("a.csv", b"\xff\xfex\0,\0y\0", "is text in UTF-16: save it as UTF-8"),
        ("a.txt", b"", "the file is empty"),
        ("a.asc", b"ncols 2\nnrows 1\n1 2\n", "line 1: this is a grid of heights"),
        ("a.xyz", b"1 2 3\0\0", "zero bytes"),
    ] {
        let error = error_of(name, bytes);
        assert!(error.contains(reason) && error.contains(name), "{error}");
    }
}

#[test]
fn placeholders_are_reported_for_any_name() {
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n".to_owned();
    let page = "\n<!DOCTYPE html>\n<html>Sign in</html>\n".to_owned();
    let formats = Registry::default();
    let extensions = formats.formats().iter().flat_map(|format| format.extensions);
    let foreign = ["npy", "bt", "zip", "pcap", "dat"];
    for extension in extensions.chain(&foreign) {
        for (text, reason) in
            [(&pointer, "is a Git LFS pointer, not the file itself"), (&page, "is an HTML page")]
        {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(format!("a.{extension}"));
            fs::write(&path, text).unwrap();
            for format in [None, Some("pcd".to_owned())] {
                let options = ReadOptions { format, ..ReadOptions::default() };
                let error = scan_of(&path, &options).unwrap_err();
                assert!(error.contains(reason), "{extension}: {error}");
            }
            if ["pcd", "ply", "csv", "bin", "las", "e57"].contains(extension) {
                let error = scan_of(folder.path(), &ReadOptions::default()).unwrap_err();
                assert!(error.contains(reason), "a folder of {extension}: {error}");
            }
        }
    }
}

#[test]
fn archives_are_reported() {
    for (name, bytes, reason) in [
        ("a.csv", &b"PK\x03\x04..."[..], "is a ZIP archive"),
        ("a.las", b"\x1f\x8b\x08\0...", "is packed with gzip"),
        ("a.pcd", b"7z\xbc\xaf\x27\x1c..", "is a 7z archive"),
    ] {
        let error = error_of(name, bytes);
        assert!(error.contains(reason) && error.contains("unpack it"), "{error}");
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    fs::write(&path, b"\x1f\x8b\x08\0...").unwrap();
    let options = ReadOptions { format: Some("ply".into()), ..ReadOptions::default() };
    assert!(failure(&path, &options).0.contains("is packed with gzip"));
}

#[cfg(unix)]
#[test]
fn broken_links_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    std::os::unix::fs::symlink("../lost.las", &path).unwrap();
    let error = failure(&path, &ReadOptions::default()).0;
    assert!(error.contains("is a link to ../lost.las, which does not exist"), "{error}");
}

#[test]
fn ply_headers_in_any_case_and_line_ends() {
    let head = "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n\
                end_header\n";
    let body = "1.5 -2.25 3\n4 5 6\n";
    for text in [
        format!("{head}{body}"),
        format!("{}{body}", head.replacen("ply\n", "ply \n", 1)),
        format!("\u{feff}{head}{body}"),
        format!("{head}{body}").replace('\n', "\r"),
        format!("{head}{body}").replace('\n', "\r\n"),
        format!("{}{body}", head.to_uppercase()),
        format!("{head}1.5 -2.25\n3 4 5 6\n"),
        format!("{head}1.5\n-2.25\n3\n4\n5\n6\n"),
    ] {
        assert_eq!(read_text("a.ply", &text).0, WANTED, "{text}");
    }
    // Properties that are not read may contain words.
    let labelled = head.replace("end_header", "property int label\nend_header");
    let (points, remarks) = read_text("a.ply", &format!("{labelled}1.5 -2.25 3 wall\n4 5 6 floor\n"));
    assert_eq!((points.as_slice(), remarks.len()), (&WANTED[..], 0));
    let (points, remarks) = read_text("a.ply", &format!("{head}1.5 -2.25 3\n4 five 6\n"));
    assert_eq!(points, WANTED[..1]);
    assert_eq!(remarks, ["1 row is not a point, skipped (line 9: `five` is not a number)"]);
    // A missing number in wrapped lines, followed by faces.
    let faces = head.replace("end_header", "element face 1\nproperty list uchar int i\nend_header");
    let whole = format!("{faces}1.5 -2.25\n3 4 5 6\n3 0 1 0\n");
    assert_eq!(read_text("a.ply", &whole).0, WANTED);
    for body in ["1.5 -2.25\n4 5 6\n3 0 1 0\n", "1.5 -2.25\n3 4 5 6 7\n3 0 1 0\n"] {
        let error = error_of("a.ply", format!("{faces}{body}").as_bytes());
        assert!(error.contains("line 1"), "{error}");
    }
    let units = head
        .replace("float x", "float x_mm")
        .replace("float y", "float y_mm")
        .replace("float z", "float z_mm");
    let (points, remarks) = read_text("a.ply", &format!("{units}1500 -2250 3000\n4000 5000 6000\n"));
    assert_eq!(points, WANTED);
    assert!(remarks[0].contains("x, y and z are in mm"), "{remarks:?}");
    let comment = head.replace("element", "comment units: mm\nelement");
    let (_, remarks) = read_text("a.ply", &format!("{comment}{body}"));
    assert!(remarks[0].contains("line 3 contains `comment units: mm`"), "{remarks:?}");
}

/// In a binary file with CR line ends, the first number directly follows the last CR, even if it starts with an LF
/// byte.
#[test]
fn binary_ply_after_cr_line_ends() {
    let head = "ply\rformat binary_little_endian 1.0\relement vertex 2\rproperty uchar label\rproperty float x\r\
                property float y\rproperty float z\rend_header\r";
    let row = |[x, y, z]: [f64; 3]| {
        [&[b'\n'][..], &(x as f32).to_le_bytes(), &(y as f32).to_le_bytes(), &(z as f32).to_le_bytes()]
            .concat()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.ply");
    fs::write(&path, [head.as_bytes(), &row(WANTED[0]), &row(WANTED[1])].concat()).unwrap();
    assert_eq!(read(&path, &ReadOptions::default()).0, WANTED);
}

fn scan_of(path: &Path, options: &ReadOptions) -> Result<(Vec<[f64; 3]>, Vec<String>), String> {
    let mut scans = open_scans(path, options).map_err(|error| format!("{error:#}"))?;
    let scan = scans.next_scan().map_err(|error| format!("{error:#}"))?.unwrap();
    Ok((scan.points_in_sensor, scans.remarks()))
}

#[test]
fn pcd_headers_in_any_case_and_line_ends() {
    let head = "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n";
    let body = "1.5 -2.25 3\n4 5 6\n";
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.pcd");
    let renamed = folder.path().join("a.dat");
    let write = |text: &str| {
        fs::write(&path, text).unwrap();
        fs::write(&renamed, text).unwrap();
    };
    let options = ReadOptions::default();
    for text in [
        format!("{head}{body}"),
        format!("{}{body}", head.replace("x y z", "X Y Z").replace("ascii", "ASCII")),
        format!("{}{body}", head.to_lowercase()),
        format!("\u{feff}{head}{body}"),
        format!("{head}{body}").replace('\n', "\r"),
        format!("{head}{body}").replace('\n', "\r\n"),
        format!("{}{body}", head.replace("VIEWPOINT 0 0 0 1", "VIEWPOINT 0 0 0 0")),
        format!("{}1500 -2250 3000\n4000 5000 6000\n", head.replace("x y z", "x_mm y_mm z_mm")),
    ] {
        write(&text);
        for path in [&path, &renamed] {
            assert_eq!(scan_of(path, &options).map(|(points, _)| points), Ok(WANTED.to_vec()), "{text}");
        }
    }
    write(&format!("{head}1.5 -2.25 3\n-nan(ind) 1.#QNAN nan\n"));
    assert_eq!(scan_of(&path, &options).map(|(points, _)| points[1][0].is_nan()), Ok(true));
    write(&format!("{head}1.5 -2.25 3\n4 five 6\n"));
    let (points, remarks) = scan_of(&path, &options).unwrap();
    assert_eq!(points, WANTED[..1]);
    assert!(
        remarks[0].ends_with("1 row is not a point, skipped (line 13: `five` is not a number)"),
        "{remarks:?}"
    );
    write(&format!("{head}1.5 -2.25 3\n4 5\n"));
    let error = scan_of(&path, &options).unwrap_err();
    assert!(error.contains("line 13: 2 values; field z is missing"), "{error}");
    write(&format!("{}{body}", head.replace("x y z", "a b z")));
    let error = scan_of(&path, &options).unwrap_err();
    assert!(error.contains("the points have no field x, y; fields: `a b z`"), "{error}");
    // An invalid viewpoint is an error only if it is needed.
    write(&format!("{}{body}", head.replace("VIEWPOINT 0 0 0 1", "VIEWPOINT 1 0 0 0")));
    assert!(scan_of(&path, &options).unwrap_err().contains("VIEWPOINT"));
    let posed = ReadOptions { poses: Some("identity".into()), ..ReadOptions::default() };
    assert_eq!(scan_of(&path, &posed).map(|(points, _)| points), Ok(WANTED.to_vec()));
}

/// Numbers for a headerless file: points of a room in random order.
fn raw(points: usize, row: impl Fn(usize, [f64; 3]) -> Vec<f64>) -> Vec<f64> {
    let mut state = 1_u64;
    let mut part = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f64 / (1 << 24) as f64
    };
    let mut place = || [1.0 + 6.0 * part(), 8.0 * part() - 4.0, part() - 1.0];
    (0..points).flat_map(|k| row(k, place())).collect()
}

#[test]
fn columns_of_raw_numbers_are_checked_and_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    let floats =
        |values: &[f64]| values.iter().flat_map(|value| (*value as f32).to_le_bytes()).collect::<Vec<u8>>();
    let doubles = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    for (bytes, expected) in [
        (
            floats(&raw(420, |k, [x, y, z]| vec![x, y, z, (k % 7) as f64])),
            "4 columns of float32: x y z intensity",
        ),
        (floats(&raw(420, |_, place| place.to_vec())), "3 columns of float32: x y z"),
        (
            floats(&raw(420, |_, [x, y, z]| vec![x, y, z, 0.5, 0.5, 0.5])),
            "6 columns of float32: x y z, the others are ignored (set with `fields`)",
        ),
        (doubles(&raw(420, |_, place| place.to_vec())), "3 columns of float64: x y z"),
        (
            doubles(&raw(420, |k, [x, y, z]| vec![x, y, z, (k % 7) as f64])),
            "4 columns of float64: x y z intensity",
        ),
    ] {
        fs::write(&path, bytes).unwrap();
        let (points, remarks) = read(&path, &ReadOptions::default());
        assert_eq!(remarks, [expected]);
        assert_eq!(points.len(), 420, "{expected}");
        let first = raw(1, |_, place| place.to_vec());
        assert!(
            points[0].iter().zip(&first).all(|(found, wanted)| (found - wanted).abs() < 1e-6),
            "{expected}"
        );
    }
    fs::write(
        &path,
        floats(&raw(420, |k, [x, y, z]| vec![x, y, z, 0.5, 7.25, -9.0, k as f64 * 1e-3 + 50.0])),
    )
    .unwrap();
    let (error, points) = failure(&path, &ReadOptions::default());
    assert!(
        error.contains("repeat every 7 of float32, not every 4") && error.contains("`fields` x,y,z"),
        "{error}"
    );
    assert_eq!(points, 0);
}

#[test]
fn fields_of_raw_numbers_have_types_and_units() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bin");
    let row = |[x, y, z]: [f64; 3]| {
        [
            &(x * 1e3).to_le_bytes()[..],
            &(y * 1e3).to_le_bytes(),
            &((z * 1e3) as i32).to_le_bytes(),
            &7_u16.to_le_bytes(),
        ]
        .concat()
    };
    fs::write(&path, WANTED.map(row).concat()).unwrap();
    let fields = ["x_mm:f64", "y_mm:float64", "z_mm:i32", "intensity:u16"].map(str::to_owned).to_vec();
    let options = ReadOptions { fields: Some(fields), ..ReadOptions::default() };
    let (_, points) = clouds_with(&path, &options).remove(0);
    assert_eq!(points.iter().map(|point| point.position_m).collect::<Vec<_>>(), WANTED);
    assert_eq!(points[1].intensity, 7.0);
}

#[test]
fn companion_texts_are_not_clouds() {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [
        ("1.csv", "1.5,-2.25,3\n"),
        ("2.csv", "4,5,6\n"),
        ("imu.csv", "t,ax,ay,az\n1,2,3,4\n"),
        ("cam.txt", "525 525 31.5 23.5\n"),
        ("gt_poses.txt", "0 1 2 3 0 0 0 1\n1 1 2 3 0 0 0 1\n"),
    ] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let (points, remarks) = read(folder.path(), &ReadOptions::default());
    assert_eq!(points, WANTED);
    for name in ["imu.csv", "cam.txt", "gt_poses.txt"] {
        let is_named =
            |remark: &&String| remark.starts_with(name) && remark.ends_with("is not a cloud and was skipped");
        assert_eq!(remarks.iter().filter(is_named).count(), 1, "{remarks:?}");
    }
    let names: Vec<String> = clouds(folder.path()).into_iter().map(|(head, _)| head.name).collect();
    assert_eq!(names, ["1.csv", "2.csv"]);
}

#[test]
fn text_folders_without_clouds_suggest_alternatives() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("depth")).unwrap();
    fs::write(folder.path().join("cam.txt"), "525 525 31.5 23.5\n").unwrap();
    let error = failure(folder.path(), &ReadOptions::default()).0;
    assert!(
        error.contains("cam.txt") && error.contains("did you mean one of its subfolders (depth)"),
        "{error}"
    );
    fs::write(folder.path().join("associations.txt"), "1.5 depth/1.png 1.5 rgb/1.png\n").unwrap();
    let error = failure(folder.path(), &ReadOptions::default()).0;
    assert!(error.contains("{print $1, $2}' associations.txt > depth.txt"), "{error}");
}
