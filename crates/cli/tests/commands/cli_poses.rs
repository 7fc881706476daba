//! Tests of poses in an input, next to it, or given by an option.

use assert_cmd::Command;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

fn voxtile(arguments: &[&str]) -> Command {
    let mut command = Command::cargo_bin("voxtile").unwrap();
    command.args(arguments);
    command
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

fn refusal(arguments: &[&str]) -> String {
    let output = voxtile(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

/// Maps an input and returns the x of its scan origins.
fn origins_m(folder: &TempDir, input: &Path, options: &[&str]) -> Vec<f64> {
    let map = folder.path().join("map");
    let built = voxtile(&[&["build", text(input), "-o", text(&map)], options].concat()).output().unwrap();
    assert!(built.status.success(), "{options:?}: {}", String::from_utf8_lossy(&built.stderr));
    let reported = voxtile(&["scans", text(&map), "--each", "--json"]).output().unwrap().stdout;
    fs::remove_dir_all(&map).unwrap();
    let scans = std::str::from_utf8(&reported).unwrap().lines();
    let scans = scans.map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap());
    scans.filter_map(|scan| scan["origin_m"][0].as_f64()).collect()
}

/// Writes PCD files of one point, each with a name and the x of its `VIEWPOINT`.
fn pcd_files(folder: &Path, files: &[(&str, f64)]) -> PathBuf {
    let scans = folder.join("scans");
    fs::create_dir(&scans).unwrap();
    for (name, x_m) in files {
        let head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\n";
        let text = format!("{head}VIEWPOINT {x_m} 0 0 1 0 0 0\nPOINTS 1\nDATA ascii\n4 0 0\n");
        fs::write(scans.join(format!("{name}.pcd")), text).unwrap();
    }
    scans
}

#[test]
fn depth_images_of_7_scenes_use_the_poses_next_to_them() {
    let folder = TempDir::new().unwrap();
    let scans = folder.path().join("seq-01");
    fs::create_dir(&scans).unwrap();
    fs::write(scans.join("camera-intrinsics.txt"), "100 0 1\n0 100 1\n0 0 1\n").unwrap();
    for number in 0..3 {
        let file = File::create(scans.join(format!("frame-00000{number}.depth.png"))).unwrap();
        let mut encoder = png::Encoder::new(file, 2, 2);
        encoder.set_color(png::ColorType::Grayscale);
        encoder.set_depth(png::BitDepth::Sixteen);
        encoder.write_header().unwrap().write_image_data(&1000_u16.to_be_bytes().repeat(4)).unwrap();
        let pose = format!("1 0 0 {number}\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
        fs::write(scans.join(format!("frame-00000{number}.pose.txt")), pose).unwrap();
    }
    assert_eq!(origins_m(&folder, &scans, &[]), [0.0, 1.0, 2.0]);
    // Also with a single image.
    for number in [0, 2] {
        fs::remove_file(scans.join(format!("frame-00000{number}.depth.png"))).unwrap();
    }
    assert_eq!(origins_m(&folder, &scans, &[]), [1.0]);
    for number in 0..3 {
        fs::remove_file(scans.join(format!("frame-00000{number}.pose.txt"))).unwrap();
    }
    assert_eq!(origins_m(&folder, &scans, &[]), [0.0]);
}

/// There are as many poses as files, but the poses begin later: a file has the pose at its time, not at its number.
#[test]
fn pcd_files_with_stamps_take_poses_by_time() {
    let folder = TempDir::new().unwrap();
    let names: Vec<String> = (0..4).map(|k| format!("1700000000.{k}")).collect();
    let files: Vec<(&str, f64)> = names.iter().map(|name| (&**name, 0.0)).collect();
    let scans = pcd_files(folder.path(), &files);
    let poses = |first: i32| -> String {
        (first..first + 4)
            .map(|k| format!("{}.{} {k} 0 0 0 0 0 1\n", 1_700_000_000 + k / 10, k % 10))
            .collect()
    };
    let file = folder.path().join("slam.txt");
    fs::write(&file, poses(2)).unwrap();
    assert_eq!(origins_m(&folder, &scans, &["--poses", text(&file)]), [2.0, 3.0]);
    fs::write(&file, poses(0)).unwrap();
    assert_eq!(origins_m(&folder, &scans, &["--poses", text(&file)]), [0.0, 1.0, 2.0, 3.0]);
    // A file of poses next to the scans, with more poses than scans.
    fs::write(folder.path().join("poses_tum.txt"), poses(0) + &poses(4)).unwrap();
    assert_eq!(origins_m(&folder, &scans, &[]), [0.0, 1.0, 2.0, 3.0]);
    // Unrelated clocks.
    fs::write(&file, "5 7 0 0 0 0 0 1\n6 8 0 0 0 0 0 1\n7 9 0 0 0 0 0 1\n8 10 0 0 0 0 0 1\n").unwrap();
    assert_eq!(origins_m(&folder, &scans, &["--poses", text(&file)]), [7.0, 8.0, 9.0, 10.0]);
}

#[test]
fn pcd_files_accept_every_format_of_poses() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 0.0)]);
    let file = folder.path().join("poses.csv");
    let option = ["--poses", text(&file)];
    for text in [
        "timestamp,x,y,z,qx,qy,qz,qw\n1,5,0,0,0,0,0,1\n2,6,0,0,0,0,0,1\n",
        "\u{feff}# of an editor on Windows\r\n1 5 0 0 0 0 0 1\r\n2 6 0 0 0 0 0 1\r\n",
        "\u{feff}1 5 0 0 0 0 0 1\n2 6 0 0 0 0 0 1\n",
        "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 0 0 6\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
    ] {
        fs::write(&file, text).unwrap();
        assert_eq!(origins_m(&folder, &scans, &option), [5.0, 6.0], "{text}");
    }
    fs::write(&file, "1 5 0 0 0 0 0 1\n2 six 0 0 0 0 0 1\n").unwrap();
    assert_eq!(origins_m(&folder, &scans, &option), [5.0]);
    let map = folder.path().join("map");
    fs::write(&file, "1 five 0 0 0 0 0 1\n2 six 0 0 0 0 0 1\n").unwrap();
    let reported = refusal(&["build", text(&scans), "--poses", text(&file), "-o", text(&map)]);
    assert!(reported.contains("line 1") && reported.contains("`five` is not a number"), "{reported}");
    // The error names the first and the last cloud, where a file that is no cloud often is.
    let three = "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n".repeat(3);
    fs::write(&file, three).unwrap();
    let reported = refusal(&["build", text(&scans), "--poses", text(&file), "-o", text(&map)]);
    assert!(reported.contains("3 poses for 2 clouds (0.pcd to 1.pcd)"), "{reported}");
}

#[test]
fn a_viewpoint_is_the_default_pose() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 3.0), ("1", 5.0)]);
    assert_eq!(origins_m(&folder, &scans, &[]), [3.0, 5.0]);
    assert_eq!(origins_m(&folder, &scans, &["--world-frame"]), [3.0, 5.0]);
    assert_eq!(origins_m(&folder, &scans, &["--extrinsic", "1", "0", "0", "0", "0", "0", "1"]), [4.0, 6.0]);
}

#[test]
fn rays_of_pcd_files_begin_at_the_viewpoint() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 0.0)]);
    let map = folder.path().join("map");
    assert_eq!(origins_m(&folder, &scans, &["--sensor-origin", "2", "0", "0"]), [2.0, 2.0]);
    let alone = scans.join("0.pcd");
    let options = ["--sensor-origin", "2", "0", "0", "--resolution", "0.5"];
    assert!(
        voxtile(&[&["build", text(&alone), "-o", text(&map)], &options[..]].concat())
            .output()
            .unwrap()
            .status
            .success()
    );
    // The point is unchanged and the ray begins at the sensor.
    let state = |x: &str| {
        let reported = voxtile(&["query", text(&map), x, "0", "0", "--json"]).output().unwrap().stdout;
        serde_json::from_slice::<serde_json::Value>(&reported).unwrap()["state"].clone()
    };
    assert_eq!([state("4.1"), state("3.1"), state("1.1")], ["occupied", "free", "unknown"]);
}

#[test]
fn pcd_files_without_poses_are_listed_and_mapped_without_rays() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 0.0)]);
    let map = folder.path().join("map");
    let reported = refusal(&["build", text(&scans), "-o", text(&map)]);
    assert!(reported.contains("has no poses"), "{reported}");
    let built = voxtile(&["build", text(&scans), "-o", text(&map), "--no-rays"]).output().unwrap();
    let reported =
        String::from_utf8_lossy(&built.stdout).into_owned() + &String::from_utf8_lossy(&built.stderr);
    assert!(built.status.success() && reported.contains("1 occupied"), "{reported}");
    let reported = voxtile(&["scans", text(&scans)]).output().unwrap();
    assert!(reported.status.success(), "{}", String::from_utf8_lossy(&reported.stderr));
}

/// The reason is printed once, and no empty map remains.
#[test]
fn an_input_without_any_pose_makes_no_map_of_bad_scans() {
    let folder = TempDir::new().unwrap();
    let scans = folder.path().join("scans");
    fs::create_dir(&scans).unwrap();
    for stamp in ["1600000000.0", "1600000001.0"] {
        fs::write(scans.join(format!("{stamp}.xyz")), "4 0 0\n4 1 0\n").unwrap();
    }
    let poses = folder.path().join("poses.txt");
    fs::write(&poses, "1284035200 0 0 1 0 0 0 1\n1284035210 0 0 1 0 0 0 1\n").unwrap();
    let map = folder.path().join("map");
    let reported = refusal(&["build", text(&scans), "--poses", text(&poses), "-o", text(&map), "--skip-bad"]);
    assert_eq!(reported.matches("none of its 2 clouds has a pose").count(), 1, "{reported}");
    assert!(!map.exists());
}

/// Creates a FIFO without a writer.
#[cfg(unix)]
fn fifo(path: &Path) {
    assert!(std::process::Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Runs a command that must fail. A command that waits for a FIFO is killed and prints nothing.
#[cfg(unix)]
fn refusal_in_time(arguments: &[&str]) -> String {
    let output = voxtile(arguments).timeout(std::time::Duration::from_secs(30)).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8(output.stderr).unwrap()
}

#[cfg(unix)]
#[test]
fn fifos_among_clouds_do_not_block() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 1.0)]);
    let clouds = folder.path().join("clouds");
    fs::create_dir(&clouds).unwrap();
    fs::write(clouds.join("0.xyz"), "1 2 3\n").unwrap();
    fifo(&clouds.join("1.xyz"));
    fifo(&scans.join("2.pcd"));
    for options in [&["--poses", "identity"][..], &["--no-rays"]] {
        for (input, name) in [(&clouds, "1.xyz"), (&scans, "2.pcd")] {
            let map = folder.path().join(format!("{name}{}", options.len()));
            let message = refusal_in_time(&[&["build", text(input), "-o", text(&map)], options].concat());
            assert!(message.contains(name) && message.contains("is a FIFO"), "{options:?}: {message}");
        }
    }
    // As the only input.
    for (path, hint) in [(clouds.join("1.xyz"), "--format"), (scans.join("2.pcd"), "save its contents")] {
        let message = refusal_in_time(&["scans", text(&path)]);
        assert!(message.contains("is a FIFO") && message.contains(hint), "{message}");
    }
}

#[cfg(unix)]
#[test]
fn a_fifo_given_as_input_is_streamed() {
    let folder = TempDir::new().unwrap();
    let [clouds, poses, cloud] = ["clouds", "poses", "cloud"].map(|name| folder.path().join(name));
    fs::create_dir(&clouds).unwrap();
    for name in ["1700000001.0.xyz", "1700000002.0.xyz"] {
        fs::write(clouds.join(name), "1 2 3\n").unwrap();
    }
    fifo(&poses);
    fifo(&cloud);
    let write = |path: &Path, text: &str| {
        let (path, text) = (path.to_owned(), text.to_owned());
        std::thread::spawn(move || fs::write(path, text).unwrap())
    };
    let written = write(&poses, "1700000001 5 0 0 0 0 0 1\n1700000002 6 0 0 0 0 0 1\n");
    assert_eq!(origins_m(&folder, &clouds, &["--poses", text(&poses)]), [5.0, 6.0]);
    written.join().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 0.0)]);
    let written = write(&poses, "1 5 0 0 0 0 0 1\n2 6 0 0 0 0 0 1\n");
    assert_eq!(origins_m(&folder, &scans, &["--poses", text(&poses)]), [5.0, 6.0]);
    written.join().unwrap();
    let written = write(&cloud, "1 2 3\n4 5 6\n");
    let listed = voxtile(&["scans", text(&cloud), "--format", "xyz"]).output().unwrap();
    assert!(String::from_utf8(listed.stdout).unwrap().contains("1, 2 points"));
    written.join().unwrap();
}

/// Some programs write a long comment into one line.
#[test]
fn long_comments_in_a_file_of_poses_are_skipped() {
    let folder = TempDir::new().unwrap();
    let scans = pcd_files(folder.path(), &[("0", 0.0), ("1", 1.0)]);
    let poses = folder.path().join("poses.txt");
    let text_of_poses = format!("# {}\n1 5 0 0 0 0 0 1\n2 6 0 0 0 0 0 1\n", "x".repeat(200_000));
    fs::write(&poses, text_of_poses).unwrap();
    assert_eq!(origins_m(&folder, &scans, &["--poses", text(&poses)]), [5.0, 6.0]);
    fs::write(&poses, format!("1 {}\n", "5 ".repeat(100_000))).unwrap();
    assert!(
        refusal(&["scans", text(&scans), "--poses", text(&poses)]).contains("line 1: the line is longer")
    );
}

/// Clouds whose points have times, with a pose file; `bend` sets how the body moves.
fn turning_clouds(folder: &Path, bend: f64, name: &str) -> (PathBuf, PathBuf) {
    let scans = folder.join("turning");
    fs::create_dir_all(&scans).unwrap();
    for scan in 0..4_i64 {
        let mut text = "x,y,z,t[ns]\n".to_owned();
        for point in 0..400_i64 {
            let angle = f64::from(point as i32) * 0.016;
            let (sin, cos) = angle.sin_cos();
            text += &format!(
                "{:.3},{:.3},{:.3},{}\n",
                8.0 * cos,
                6.0 * sin,
                (point % 7) as f64 * 0.2,
                250_000 * point
            );
        }
        fs::write(scans.join(format!("{}.csv", 1_700_000_000_000_000_000 + 100_000_000 * scan)), text)
            .unwrap();
    }
    let mut text = String::new();
    for step in -10..60_i64 {
        let s = step as f64 * 0.01;
        let half = 0.5 * bend * s;
        let stamp_ns = 1_700_000_000_000_000_000 + 10_000_000 * step;
        let (seconds, rest) = (stamp_ns.div_euclid(1_000_000_000), stamp_ns.rem_euclid(1_000_000_000));
        text += &format!(
            "{seconds}.{rest:09} {} {} 0 0 0 {} {}\n",
            9.0 * s,
            bend * s * s,
            half.sin(),
            half.cos()
        );
    }
    let poses = folder.join(name);
    fs::write(&poses, text).unwrap();
    (scans, poses)
}

/// A corrected trajectory corrects the shape of each scan too: as if the scans had been read with it.
#[test]
fn new_poses_deskew_kept_scans_again() {
    let folder = TempDir::new().unwrap();
    let (scans, old) = turning_clouds(folder.path(), 1.0, "old.tum");
    let (_, new) = turning_clouds(folder.path(), 2.5, "new.tum");
    let mount = ["--extrinsic", "0.3", "0", "1.5", "0", "0", "0.1", "0.99498743710662"];
    let map = |name: &str| folder.path().join(name);
    let build = |name: &str, poses: &Path, more: &[&str]| {
        let path = map(name);
        let to = [
            "build",
            text(&scans),
            "-o",
            text(&path),
            "--poses",
            text(poses),
            "--resolution",
            "0.1",
            "--quiet",
        ];
        voxtile(&[&to[..], &mount, more].concat()).assert().success();
        path
    };
    let digest = |path: &Path, more: &[&str]| {
        let output = voxtile(&[&["digest", text(path)], more].concat()).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap().split_whitespace().next().unwrap().to_owned()
    };
    let keeping = ["--deskew", "--keep-scans"];
    let [kept, wanted] = [build("kept", &old, &keeping), build("wanted", &new, &keeping)];
    assert_eq!(digest(&kept, &[]), digest(&build("unkept", &old, &["--deskew"]), &[]));
    assert_ne!(digest(&kept, &[]), digest(&build("skewed", &old, &[]), &[]));
    let before = digest(&kept, &["--scans"]);
    // The pose of the sensor in the body frame is kept with the scans.
    voxtile(&["remap", text(&kept), "--poses", text(&new), "--quiet"]).assert().success();
    assert_eq!(digest(&kept, &[]), digest(&wanted, &[]));
    assert_eq!(digest(&kept, &["--scans"]), digest(&wanted, &["--scans"]));
    voxtile(&["remap", text(&kept), "--poses", text(&old), "--quiet"]).assert().success();
    assert_eq!(digest(&kept, &["--scans"]), before);
    // Another map, of finer voxels, from the kept scans.
    let [fine, other] = ["fine", "other"].map(map);
    let finer = ["--resolution", "0.05", "--quiet"];
    voxtile(&[&["remap", text(&kept), "-o", text(&fine)], &finer[..]].concat()).assert().success();
    let whole = ["build", text(&scans), "-o", text(&other), "--deskew", "--poses", text(&old)];
    voxtile(&[&whole[..], &finer, &mount].concat()).assert().success();
    assert_eq!(digest(&fine, &[]), digest(&other, &[]));
    let again = map("again");
    let from_kept = ["build", text(&kept), "-o", text(&again), "--poses", text(&new), "--resolution", "0.1"];
    voxtile(&[&from_kept[..], &["--keep-scans", "--quiet"]].concat()).assert().success();
    assert_eq!(digest(&again, &[]), digest(&wanted, &[]));
    assert_eq!(digest(&again, &["--scans"]), digest(&wanted, &["--scans"]));
    voxtile(&["verify", text(&kept)]).assert().success();
    let metadata = fs::read_to_string(kept.join("metadata.json")).unwrap();
    assert!(metadata.contains("\"version\": \"1.3\""), "{metadata}");
}
