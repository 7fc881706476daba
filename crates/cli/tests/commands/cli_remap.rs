use crate::cli::{failure, json, map_with_a_passer_by, output, scans, text, voxtile};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use voxtile::MapReader;

/// A map that keeps three scans, and the folder from which it was built.
struct Kept {
    folder: TempDir,
    scans: PathBuf,
    map: String,
}

const TILES: [&str; 2] = ["--tile-size", "1"];

impl Kept {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let scans = scans(&folder);
        let kept = Self { map: text(&folder.path().join("map")).to_owned(), folder, scans };
        output(&[&["build", text(&kept.scans), "-o", &kept.map, "--keep-scans"][..], &TILES].concat());
        kept
    }

    fn path(&self, name: &str) -> String {
        text(&self.folder.path().join(name)).to_owned()
    }

    /// Writes a file with the poses of the scans, where scan `k` is moved by `k * by_m`.
    fn poses(&self, name: &str, by_m: f64) -> String {
        let path = self.path(name);
        let own = fs::read_to_string(self.scans.join("poses_kitti.txt")).unwrap();
        let moved = own.lines().enumerate().map(|(number, line)| {
            let mut numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().unwrap()).collect();
            numbers[3] += by_m * number as f64;
            numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ") + "\n"
        });
        fs::write(&path, moved.collect::<String>()).unwrap();
        path
    }

    /// Returns the digest of a new build with other poses.
    fn digest_with(&self, poses: &str, map: &str) -> String {
        let map = self.path(map);
        output(&[&["build", text(&self.scans), "-o", &map, "--poses", poses][..], &TILES].concat());
        digest(&map)
    }
}

/// Runs a command that must fail with this code and returns its message.
fn fails(arguments: &[&str], code: i32) -> String {
    let (found, message) = failure(arguments);
    assert_eq!(found, code, "{message}");
    message
}

fn digest(map: &str) -> String {
    output(&["digest", map])
}

#[test]
fn a_remapped_map_equals_a_build_with_the_new_poses() {
    let kept = Kept::new();
    let before = digest(&kept.map);
    let moved = kept.poses("moved.txt", 0.3);
    let dry = json(&["remap", &kept.map, "--poses", &moved, "--dry-run", "--json"]);
    assert_eq!((&dry["dry_run"], &dry["scans_changed"]), (&true.into(), &2.into()));
    assert!(dry["estimated_s"].as_f64().unwrap() > 0.0);
    assert_eq!(digest(&kept.map), before);
    let done = json(&["remap", &kept.map, "--poses", &moved, "--keep-as", "before", "--json"]);
    assert_eq!((&done["scans_changed"], &done["kept_as"]), (&2.into(), &"before".into()));
    assert!((done["largest_move_m"].as_f64().unwrap() - 0.6).abs() < 1e-9);
    assert_eq!(digest(&kept.map), kept.digest_with(&moved, "again"));
    assert_eq!(digest(&format!("{}@before", kept.map)), before);
    assert!(output(&["verify", &kept.map]).contains("intact"));
    // A build with the new poses resumes, and no scan counts twice.
    let resume = ["build", text(&kept.scans), "-o", &kept.map, "--poses", &moved, "--resume", "--json"];
    assert_eq!(json(&resume)["resumed_after"], 3);
    // Move the scans back. One of the two moves is within the tolerance, so this scan stays.
    let own = kept.poses("own.txt", 0.0);
    let reported = output(&["remap", &kept.map, "--poses", &own, "--tolerance", "0.4m,1deg"]);
    assert!(
        reported.contains("1 scan moved, by up to 0.600 m") && reported.contains("1 scan unchanged"),
        "{reported}"
    );
    output(&["remap", &kept.map, "--poses", &own]);
    assert_eq!(digest(&kept.map), before);
    let reported = output(&["remap", &kept.map, "--poses", &own]);
    assert!(reported.contains("0 scans moved"), "{reported}");
}

/// Poses of the first and third scan, which move by 0 and 0.6 m: the second follows by half of that.
#[test]
fn scans_without_a_new_pose_follow_their_neighbors() {
    let kept = Kept::new();
    let moved = kept.poses("moved.txt", 0.3);
    let wanted = kept.digest_with(&moved, "again");
    let graph = |path: &str, ids: &[usize]| {
        let text = fs::read_to_string(&moved).unwrap();
        let lines: Vec<_> = text.lines().collect();
        let mut graph = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1\n".to_owned();
        for &id in ids {
            let rows: Vec<f64> = lines[id].split(' ').map(|word| word.parse().unwrap()).collect();
            let pose = voxtile::Pose::from_matrix(
                &rows.chunks(4).map(|row| row.try_into().unwrap()).collect::<Vec<[f64; 4]>>(),
            );
            let pose = pose.unwrap();
            let numbers = [&pose.position_m()[..], &pose.quaternion()].concat();
            let numbers: Vec<_> = numbers.iter().map(f64::to_string).collect();
            graph += &format!("VERTEX_SE3:QUAT {id} {}\n", numbers.join(" "));
        }
        graph += "FIX 0\nEDGE_SE3:QUAT 0 2 1 0 0 0 0 0 1 1 0 0\n";
        fs::write(path, graph).unwrap();
    };
    let file = kept.path("graph.g2o");
    graph(&file, &[0, 2]);
    let message = fails(&["remap", &kept.map, "--poses", &file], 2);
    assert!(message.contains("2 poses for 3 kept scans"), "{message}");
    let message = fails(&["remap", &kept.map, "--poses", &file, "--interpolate=3"], 2);
    assert!(message.contains("2 poses, but 3 kept scans in steps of 3 need 1"), "{message}");
    let message = fails(&["remap", &kept.map, "--poses", &file, "--interpolate"], 2);
    assert!(message.contains("within a millisecond"), "{message}");
    fails(&["remap", &kept.map, "--poses", &file, "--interpolate=0"], 2);
    let done = json(&["remap", &kept.map, "--poses", &file, "--interpolate=2", "--json"]);
    assert!((done["largest_move_m"].as_f64().unwrap() - 0.6).abs() < 1e-9, "{done}");
    assert_eq!(digest(&kept.map), wanted);
    // All poses of a graph are those of the scans in order.
    let whole = kept.path("whole.g2o");
    graph(&whole, &[0, 1, 2]);
    assert_eq!(kept.digest_with(&whole, "of_graph"), wanted);
    graph(&whole, &[0, 2, 1]);
    let message = fails(&["remap", &kept.map, "--poses", &whole], 1);
    assert!(message.contains("vertex 1 follows vertex 2"), "{message}");
}

#[test]
fn cropped_and_merged_maps_keep_scans() {
    let kept = Kept::new();
    let everywhere = ["--region", "-99", "-99", "-99", "99", "99", "99"];
    let part = kept.path("part");
    output(&[&["crop", &kept.map, "-o", &part, "--keep-scans"][..], &everywhere].concat());
    let of_scans = |map: &str| output(&["digest", map, "--scans"]);
    assert_eq!((digest(&part), of_scans(&part)), (digest(&kept.map), of_scans(&kept.map)));
    let moved = kept.poses("moved.txt", 0.3);
    output(&["remap", &part, "--poses", &moved]);
    assert_eq!(digest(&part), kept.digest_with(&moved, "again"));
    assert_ne!(of_scans(&part), of_scans(&kept.map));
    let bare = kept.path("bare");
    output(&[&["crop", &kept.map, "-o", &bare][..], &everywhere].concat());
    for arguments in [
        vec!["digest", &bare, "--scans"],
        [&["crop", &bare, "-o", &kept.path("x"), "--keep-scans"][..], &everywhere].concat(),
    ] {
        let message = fails(&arguments, 2);
        assert!(message.contains("keeps no scans"), "{message}");
    }
    let both = kept.path("both");
    let merged = json(&["merge", &kept.map, &part, "-o", &both, "--json"]);
    assert_eq!(merged["keeps_scans"], true, "{merged}");
    assert_eq!(json(&["scans", &both, "--json"])["scans"], 6);
}

/// The original map does not change; another one has the new poses.
#[test]
fn another_map_is_built_from_kept_scans_with_other_poses() {
    let kept = Kept::new();
    let (before, moved) = (digest(&kept.map), kept.poses("moved.txt", 0.3));
    let wanted = kept.digest_with(&moved, "again");
    let other = kept.path("other");
    output(&[&["build", &kept.map, "-o", &other, "--poses", &moved][..], &TILES].concat());
    assert_eq!((digest(&other), digest(&kept.map)), (wanted.clone(), before));
    assert_ne!(wanted, digest(&kept.map));
    // Two poses for three scans.
    let lines: Vec<_> = fs::read_to_string(&moved).unwrap().lines().take(2).map(str::to_owned).collect();
    fs::write(&moved, lines.join("\n")).unwrap();
    let message = fails(&["build", &kept.map, "-o", &kept.path("none"), "--poses", &moved], 2);
    assert!(
        message.contains("2 poses for 3 kept scans of the map: they are missing from scan 3 on"),
        "{message}"
    );
}

#[test]
fn kept_scans_are_listed_exported_and_rebuilt() {
    let kept = Kept::new();
    let reported = output(&["scans", &kept.map, "--each"]);
    assert!(
        reported.contains(" points") && reported.contains(" tiles") && reported.contains("bytes per point"),
        "{reported}"
    );
    let summary = json(&["scans", &kept.map, "--json"]);
    assert_eq!((&summary["scans"], &summary["points"]), (&3.into(), &126.into()));
    let out = kept.path("out");
    assert!(output(&["export", &kept.map, "--scans", &out]).contains("3 scans, 126 points"));
    let again = kept.path("again");
    output(&[&["build", &out, "-o", &again][..], &TILES].concat());
    assert_eq!(digest(&again), digest(&kept.map));
    let message = fails(&["export", &kept.map, "--scans", &out], 2);
    assert!(message.contains("is a folder that is not empty: choose another"), "{message}");
    let third = kept.path("third");
    output(&[&["build", &kept.map, "-o", &third][..], &TILES].concat());
    assert_eq!(digest(&third), digest(&kept.map));
    // Other parameters, without the original files.
    fs::remove_dir_all(&out).unwrap();
    let (coarse, wanted) = (kept.path("coarse"), kept.path("wanted"));
    let how = ["--resolution", "0.2", "--max-range", "2"];
    output(&[&["remap", &kept.map, "-o", &coarse][..], &how].concat());
    output(&[&["build", text(&kept.scans), "-o", &wanted, "--tile-size", "1"][..], &how].concat());
    assert_eq!(digest(&coarse), digest(&wanted));
}

#[test]
fn scans_and_points_are_removed_as_if_they_had_never_been() {
    let kept = Kept::new();
    output(&["snapshot", &kept.map, "all"]);
    let reported = output(&["remove-scans", &kept.map, "--scans", "2..3"]);
    assert!(
        reported.contains("2 scans removed") && reported.contains("all still contains some of them"),
        "{reported}"
    );
    let first = kept.path("first");
    output(&[&["build", text(&kept.scans), "-o", &first, "--count", "1"][..], &TILES].concat());
    assert_eq!(digest(&kept.map), digest(&first));
    assert_eq!(json(&["scans", &kept.map, "--json"])["scans"], 1);
    // Removed scans are not added again.
    let resumed = json(&["build", text(&kept.scans), "-o", &kept.map, "--resume", "--json"]);
    assert_eq!((&resumed["scans"], digest(&kept.map)), (&0.into(), digest(&first)));
    let all = ["--region", "-99", "-99", "-99", "99", "99", "99"];
    let gone = json(&[&["remove-points", &kept.map, "--json"][..], &all].concat());
    // One of its 42 points is invalid.
    assert_eq!((&gone["points_removed"], &gone["tiles"]), (&41.into(), &gone["tiles_mapped"]));
    assert_eq!(json(&["info", &kept.map, "--json"])["voxels"], 0);
    let message = fails(&["remove-scans", &kept.map, "--input", "nothing"], 2);
    assert!(message.contains("the map has no input"), "{message}");
}

#[test]
fn impossible_replays_are_refused_with_a_remedy() {
    let kept = Kept::new();
    let refused = |arguments: &[&str]| fails(arguments, 2);
    let three = kept.poses("poses.txt", 0.1);
    let two = fs::read_to_string(&three).unwrap().lines().take(2).collect::<Vec<_>>().join("\n");
    fs::write(&three, two).unwrap();
    let message = refused(&["remap", &kept.map, "--poses", &three]);
    assert!(
        message.contains("2 poses for 3 kept scans of the map: they are missing from scan 3 on"),
        "{message}"
    );
    let message = refused(&["remap", &kept.map, "--poses", &three, "--tolerance", "1"]);
    assert!(message.contains("0.02m,0.1deg"), "{message}");
    let message = refused(&["remove-scans", &kept.map, "--scans", "3..1"]);
    assert!(message.contains("not a range of numbers"), "{message}");
    let without = kept.path("without");
    output(&[&["build", text(&kept.scans), "-o", &without][..], &TILES].concat());
    let message = refused(&["remap", &without, "--poses", &three]);
    assert!(message.contains("keeps no scans") && message.contains("--keep-scans"), "{message}");
    let message = refused(&["export", &without, "--scans", &kept.path("out")]);
    assert!(message.contains("--keep-scans"), "{message}");
    let message = refused(&["build", text(&kept.scans), "-o", &kept.map, "--no-rays", "--append", "--again"]);
    assert!(message.contains("--no-rays, --keep-scans"), "{message}");
    output(&["clear", &kept.map, "--region", "0", "0", "0", "1", "1", "1"]);
    let poses = kept.poses("poses.txt", 0.1);
    let message = refused(&["remap", &kept.map, "--poses", &poses]);
    assert!(message.contains("a change by another operation: clear"), "{message}");
}

/// A map built with -o needs all scans, like new poses in place.
#[test]
fn another_map_is_refused_if_scans_are_not_kept() {
    let kept = Kept::new();
    let fine = kept.path("fine");
    let refused = |map: &str| {
        let message = fails(&["remap", map, "-o", &fine, "--resolution", "0.2"], 2);
        assert!(!Path::new(&fine).exists(), "{message}");
        message
    };
    let partly = kept.path("partly");
    output(&[&["build", text(&kept.scans), "-o", &partly, "--count", "1"][..], &TILES].concat());
    let rest = ["build", text(&kept.scans), "-o", &partly, "--append", "--again", "--keep-scans"];
    output(&[&rest[..], &TILES].concat());
    let message = refused(&partly);
    assert!(message.contains("scan 1, whose points are not kept"), "{message}");
    output(&["clear", &kept.map, "--region", "0", "0", "0", "1", "1", "1"]);
    let message = refused(&kept.map);
    assert!(message.contains("a change by another operation: clear"), "{message}");
}

/// A region is stored in tiles: with another tile size it keeps its bounds or is refused.
#[test]
fn another_map_keeps_the_region_for_any_tile_size() {
    let kept = Kept::new();
    let (part, wanted, found) = (kept.path("part"), kept.path("wanted"), kept.path("found"));
    let region = ["--region", "1", "-inf", "-inf", "inf", "inf", "inf"];
    let build = |out: &str, how: &[&str]| {
        output(&[&["build", text(&kept.scans), "-o", out][..], &region, how].concat());
    };
    build(&part, &["--tile-size", "1", "--keep-scans"]);
    build(&wanted, &["--tile-size", "0.5"]);
    output(&["remap", &part, "-o", &found, "--tile-size", "0.5"]);
    assert_ne!(digest(&part), digest(&kept.map));
    assert!(json(&["info", &found, "--json"])["voxels"].as_u64().unwrap() > 0);
    assert_eq!(digest(&found), digest(&wanted));
    let of = |map: &str| MapReader::config_of(map).unwrap().rays.region;
    assert_eq!(of(&found), of(&wanted));
    assert_ne!(of(&found), of(&part));
    let other = kept.path("other");
    let message = fails(&["remap", &part, "-o", &other, "--tile-size", "0.7"], 2);
    assert!(
        message.contains("0.7 m does not fit the region") && message.contains("divides 1 m"),
        "{message}"
    );
    assert!(!Path::new(&other).exists());
}

#[test]
fn another_map_of_any_resolution_has_tiles_that_fit() {
    let kept = Kept::new();
    for (resolution, tile_m) in [("0.25", 1.0), ("0.15", 10.05)] {
        let (found, wanted) = (kept.path(&format!("found {resolution}")), kept.path(resolution));
        output(&["remap", &kept.map, "-o", &found, "--resolution", resolution]);
        assert_eq!(json(&["info", &found, "--json"])["tile_size_m"], tile_m);
        let tile = tile_m.to_string();
        let build = ["build", text(&kept.scans), "-o", &wanted, "--resolution", resolution];
        output(&[&build[..], &["--tile-size", &tile]].concat());
        assert_eq!(digest(&found), digest(&wanted));
    }
}

#[test]
fn a_damaged_segment_is_named_and_repaired_around() {
    let kept = Kept::new();
    let segment = Path::new(&kept.map).join("kept_scans/segment.1");
    let mut bytes = fs::read(&segment).unwrap();
    let last = bytes.len() - 9;
    bytes[last] ^= 1;
    fs::write(&segment, bytes).unwrap();
    let before = digest(&kept.map);
    let poses = kept.poses("poses.txt", 0.1);
    let message = fails(&["remap", &kept.map, "--poses", &poses], 1);
    assert!(message.contains("segment.1") && message.contains("checksum"), "{message}");
    assert_eq!(digest(&kept.map), before);
    let found = voxtile(&["verify", &kept.map]).assert().code(1);
    assert!(String::from_utf8_lossy(&found.get_output().stdout).contains("(scan 3)"));
    voxtile(&["repair", &kept.map]).assert().code(1);
    assert!(output(&["verify", &kept.map]).contains("intact"));
    assert_eq!(digest(&kept.map), before);
    let message = fails(&["remap", &kept.map, "--poses", &poses], 2);
    assert!(message.contains("scan 3, whose points are not kept"), "{message}");
    let message = fails(&["remap", &kept.map, "-o", &kept.path("fine"), "--resolution", "0.2"], 2);
    assert!(message.contains("scan 3, whose points are not kept"), "{message}");
}

#[test]
fn an_invalid_tolerance_is_refused() {
    let kept = Kept::new();
    let poses = kept.poses("poses.txt", 0.1);
    for tolerance in ["nan", "-1", "inf", "-inf", "1e300"] {
        let option = format!("--pose-tolerance={tolerance}");
        let message = fails(&["remap", &kept.map, "--poses", &poses, &option], 2);
        assert!(
            message.contains("--pose-tolerance") && message.contains("is not a time in seconds"),
            "{message}"
        );
    }
}

/// Poses that are not in time order are matched to scans by time stamp, and refused if the scans have no stamps.
#[test]
fn unordered_poses_are_not_matched_by_line() {
    let kept = Kept::new();
    let poses = kept.path("tum.txt");
    let line = |stamp: i32| format!("{stamp} {stamp} 0 0 0 0 0 1\n");
    fs::write(&poses, [3, 2, 1].map(line).concat()).unwrap();
    let message = fails(&["remap", &kept.map, "--poses", &poses], 2);
    assert!(message.contains("its time stamps are not in order"), "{message}");
    assert_eq!(digest(&kept.map), kept.digest_with(&kept.poses("own.txt", 0.0), "same"));

    // Clouds with stamps as names.
    let clouds = kept.folder.path().join("clouds");
    fs::create_dir(&clouds).unwrap();
    for second in 1..4 {
        let head =
            "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
        let cloud = format!("{head}end_header\n2 {second} 0\n");
        fs::write(clouds.join(format!("170000000{second}.000000.ply")), cloud).unwrap();
    }
    let tum = |name: &str, order: [i32; 3], by_m: f64| {
        let line = |k: i32| format!("{} {} 0 0 0 0 0 1\n", 1_700_000_000 + k, f64::from(k) + by_m);
        fs::write(kept.path(name), order.map(line).concat()).unwrap();
        kept.path(name)
    };
    let build = |poses: &str, map: &str| {
        let map = kept.path(map);
        let more = ["--poses", poses, "--keep-scans"];
        output(&[&["build", text(&clouds), "-o", &map][..], &more, &TILES].concat());
        map
    };
    let map = build(&tum("first.txt", [1, 2, 3], 0.0), "by_time");
    let moved = build(&tum("moved.txt", [1, 2, 3], 0.5), "moved");
    output(&["remap", &map, "--poses", &tum("back.txt", [3, 1, 2], 0.5)]);
    assert_eq!(digest(&map), digest(&moved));
    // Clouds without stamps refuse such lines too.
    for second in 1..4 {
        let name = |name: &str| clouds.join(format!("{name}{second}.ply"));
        fs::rename(clouds.join(format!("170000000{second}.000000.ply")), name("scan")).unwrap();
    }
    let build = ["build", text(&clouds), "-o", &kept.path("x"), "--poses", &kept.path("back.txt")];
    for more in [&[][..], &["--skip-bad"]] {
        let message = fails(&[&build[..], more].concat(), 2);
        assert!(message.contains("its time stamps are not in order (pose 2 is earlier"), "{message}");
        assert!(!message.contains("is skipped"), "{message}");
    }
}

#[test]
fn a_map_has_one_rule_of_clearing() {
    let kept = Kept::new();
    let (guarded, again) = (kept.path("guarded"), kept.path("again"));
    let build = ["build", text(&kept.scans), "-o", &guarded, "--keep-scans", "--tile-size", "1"];
    output(&[&build[..], &["--clearing", "guarded"]].concat());
    assert_eq!(json(&["info", &guarded, "--json"])["clearing"]["guarded"]["approach_voxels"], 4);
    assert_eq!(json(&["info", &kept.map, "--json"])["clearing"], "octomap");
    assert!(output(&["info", &guarded]).contains("clearing     guarded"));
    assert_ne!(digest(&guarded), digest(&kept.map));

    // Without the option the map's rule is used; another one is an error.
    let more = ["build", text(&kept.scans), "-o", &guarded, "--append", "--again"];
    let refused = fails(&[&more[..], &["--clearing", "octomap"]].concat(), 2);
    assert!(refused.contains("rule of clearing"), "{refused}");
    output(&more);
    let per_ray = ["build", text(&kept.scans), "-o", &again, "--clearing", "guarded", "--insert", "per-ray"];
    assert!(fails(&per_ray, 2).contains("per-scan"));

    // A map of the other rule, from the kept scans.
    output(&["remap", &kept.map, "-o", &again, "--clearing", "guarded"]);
    let fresh = kept.path("fresh");
    output(&["build", text(&kept.scans), "-o", &fresh, "--tile-size", "1", "--clearing", "guarded"]);
    assert_eq!(digest(&again), digest(&fresh));
}

#[test]
fn what_moved_is_marked_exported_and_unmarked() {
    let folder = TempDir::new().unwrap();
    let (map, passing) = map_with_a_passer_by(folder.path());
    let (map, path) = (text(&map).to_owned(), |name: &str| text(&folder.path().join(name)).to_owned());
    let before = digest(&map);
    let planned = json(&["clean", &map, "--dry-run", "--json"]);
    let cleaned = json(&["clean", &map, "--keep-as", "before", "--json"]);
    assert_eq!((&cleaned["scans_changed"], &cleaned["kept_as"]), (&1.into(), &"before".into()));
    assert_eq!(planned["points_changed"], cleaned["points_changed"]);
    let marked = cleaned["points_changed"].as_u64().unwrap();
    assert!(marked > passing * 9 / 10 && marked <= passing, "{marked} of {passing}");
    assert_ne!(digest(&map), before);
    let again = output(&["clean", &map]);
    assert!(again.contains(&format!("moving    {marked} of 39,366 points marked\n")), "{again}");
    assert!(again.contains("0 changed"), "{again}");

    let moving = json(&["export", &map, "--scans", &path("moving"), "--only-moving", "--json"]);
    assert_eq!((&moving["scans"], &moving["points"]), (&1.into(), &marked.into()));
    let all = json(&["export", &map, "--scans", &path("all"), "--json"]);
    assert_eq!(
        (&all["scans"], &all["points"], &all["moving_points"]),
        (&6.into(), &39366.into(), &marked.into())
    );
    let pcd = fs::read(folder.path().join("all/000003.pcd")).unwrap();
    let head = "FIELDS x y z moving\nSIZE 8 8 8 1\nTYPE F F F U\nCOUNT 1 1 1 1\nWIDTH 6561\n";
    assert!(String::from_utf8_lossy(&pcd[..200]).contains(head), "{}", String::from_utf8_lossy(&pcd[..200]));
    let flags = pcd[pcd.len() - 6561 * 25..].chunks(25).filter(|record| record[24] == 1).count();
    assert_eq!(flags as u64, marked);

    // A map that is built from this one has the marks, too.
    let other = path("other");
    let options = ["--keep-scans", "--resolution", "0.2", "--clearing", "guarded"];
    output(&[&["build", &map, "-o", &other][..], &options].concat());
    assert_eq!(digest(&other), digest(&map));
    let undone = json(&["clean", &map, "--undo", "--json"]);
    assert_eq!((&undone["points_changed"], &undone["undo"]), (&marked.into(), &true.into()));
    assert_eq!(digest(&map), before);

    fails(&["clean", &other, "--undo", "--parked-scans", "3"], 2);
    fails(&["clean", &other, "--parked-scans", "0"], 2);
    assert_eq!(json(&["clean", &other, "--parked-scans", "1", "--json"])["points_changed"], 0);
    // The map may be the current folder. Nothing changes, so there is no snapshot.
    let mut here = voxtile(&["clean", ".", "--parked-scans", "1", "--keep-as", "none", "--json"]);
    let here = here.current_dir(&other).output().unwrap();
    assert!(here.status.success(), "{}", String::from_utf8_lossy(&here.stderr));
    let here: serde_json::Value = serde_json::from_slice(&here.stdout).unwrap();
    assert_eq!(here["kept_as"], serde_json::Value::Null);

    // A search that fails leaves the earlier marks.
    output(&["clean", &map]);
    let (far_scan, far_poses) = (path("far.xyz"), path("far.txt"));
    let far: String = (0..200).map(|k| format!("5 {} 1\n", 0.1 * f64::from(k))).collect();
    fs::write(&far_scan, far).unwrap();
    fs::write(&far_poses, "1 0 0 500 0 1 0 0 0 0 1 0\n").unwrap();
    output(&["build", &far_scan, "--poses", &far_poses, "-o", &map, "--append"]);
    let segments =
        fs::read_dir(Path::new(&map).join("kept_scans")).unwrap().map(|entry| entry.unwrap().path());
    let number = |path: &PathBuf| path.extension().and_then(|number| number.to_str()?.parse::<u64>().ok());
    let newest = segments.filter(|path| path.file_stem().unwrap() == "segment").max_by_key(number).unwrap();
    let mut bytes = fs::read(&newest).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&newest, bytes).unwrap();
    let marked = json(&["scans", &map, "--json"])["moving_points"].as_u64().unwrap();
    fails(&["clean", &map], 1);
    assert!(marked > 0 && json(&["scans", &map, "--json"])["moving_points"] == marked, "{marked}");
}
