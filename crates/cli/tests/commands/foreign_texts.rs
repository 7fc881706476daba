//! Tests of text and raw files of other programs with the command.

use assert_cmd::Command;
use std::fs;
use std::path::Path;

fn voxtile(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::cargo_bin("voxtile").unwrap().args(arguments).output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.success(), stdout, stderr)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn points_of_a_query_may_have_decimal_commas_and_units() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("wall.csv"), "x;y;z\n2,75;-1,25;0,35\n").unwrap();
    let (map, wall) = (at("map"), at("wall.csv"));
    let arguments =
        ["build", text(&wall), "-o", text(&map), "--resolution", "0.1", "--no-rays", "--poses", "identity"];
    let (is_built, _, errors) = voxtile(&arguments);
    assert!(is_built, "{errors}");
    for points in [
        "2,75;-1,25;0,35\n",
        "2,75\t-1,25\t0,35\r",
        "x (mm),y (mm),z (mm)\n2750,-1250,350\n",
        "2.75 -1.25 0.35",
    ] {
        fs::write(at("points.txt"), points).unwrap();
        let (is_read, answer, errors) = voxtile(&["query", text(&map), "--points", text(&at("points.txt"))]);
        assert!(is_read, "{errors}");
        assert!(answer.starts_with("2.75 -1.25 0.35  occupied"), "{points}: {answer}");
    }
    fs::write(at("points.txt"), "2,050,-1,250,0,350\n").unwrap();
    let (is_read, _, errors) = voxtile(&["query", text(&map), "--points", text(&at("points.txt"))]);
    assert!(!is_read && errors.contains("points.txt") && errors.contains("line 1"), "{errors}");
}

#[test]
fn guesses_are_printed() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let rows =
        (0..60_u16).map(f32::from).map(|k| [4.0 + 0.5 * (k * 0.7).sin(), 0.1 * k - 3.0, 0.3 - 0.01 * k]);
    let floats: Vec<u8> = rows.flatten().flat_map(f32::to_le_bytes).collect();
    fs::write(at("a.bin"), floats).unwrap();
    fs::write(at("a.csv"), "x (cm),y (cm),z (cm)\n100,200,300\n100,200,px\n").unwrap();
    for (name, remarks) in [
        ("a.bin", &["3 columns of float32: x y z"][..]),
        (
            "a.csv",
            &[
                "coordinates are converted to metres: x, y and z are in cm",
                "1 row is not a point, skipped (line 3: `px` is not a number)",
            ],
        ),
    ] {
        let map = at(&format!("map of {name}"));
        let (is_built, printed, errors) =
            voxtile(&["build", text(&at(name)), "-o", text(&map), "--poses", "identity", "--no-rays"]);
        assert!(is_built, "{errors}");
        for remark in remarks {
            assert!(format!("{printed}{errors}").contains(remark), "{name}: {printed}{errors}");
        }
    }
}

#[test]
fn intrinsics_next_to_depth_images_are_no_cloud() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("depth")).unwrap();
    fs::write(folder.path().join("cam.txt"), "525 525 31.5 23.5\n").unwrap();
    fs::write(folder.path().join("poses.txt"), "1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    let map = folder.path().join("map");
    let (is_built, _, errors) = voxtile(&["build", text(folder.path()), "-o", text(&map), "--no-rays"]);
    assert!(!is_built && errors.contains("cam.txt") && errors.contains("(depth)"), "{errors}");
}
