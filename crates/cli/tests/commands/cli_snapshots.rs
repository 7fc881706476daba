use crate::cli::{failure, json, output, scans, text};
use std::fs;
use tempfile::TempDir;

#[test]
fn a_bad_session_is_reverted_and_snapshots_are_readable() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("map"));
    let map = text(&map);
    for storage in ["octomap", "compact"] {
        output(&["build", text(&scans), "-o", map, "--storage", storage]);
        let before = output(&["digest", map]);
        let printed = output(&["snapshot", map, "good"]);
        assert!(printed.contains("kept      good: flush") && printed.contains("scan 3"), "{printed}");
        output(&["build", text(&scans), "-o", map, "--append", "--again"]);
        let after = output(&["digest", map]);
        assert_ne!(before, after);

        let past = format!("{map}@good");
        assert_eq!(output(&["digest", &past]), before);
        assert_eq!(json(&["info", &past, "--json"])["scan_number"], 3);
        assert_eq!(json(&["query", &past, "4.05", "0", "0.55", "--json"])["observation_count"], 3);
        assert_eq!(json(&["query", map, "4.05", "0", "0.55", "--json"])["observation_count"], 6);
        let copy = folder.path().join(format!("copy_{storage}"));
        output(&["convert", &past, "-o", text(&copy), "--storage", "compact"]);
        assert_eq!(output(&["digest", text(&copy)]), before);

        let listed = json(&["snapshots", map, "--json"]);
        assert_eq!(listed["snapshots"][0]["name"], "good");
        assert!(listed["snapshots"][0]["own_bytes"].as_u64().unwrap() > 200);
        assert!(output(&["snapshots", map]).contains("used only by it"));

        let changed = json(&["diff", &past, map, "--json"]);
        let again = json(&["diff", map, "good", "now", "--json"]);
        for key in ["from", "to", "tiles", "tiles_changed", "tiles_equal", "changed", "to_free"] {
            assert_eq!(changed[key], again[key], "{key}");
        }
        assert_eq!((changed["appeared"].as_u64(), changed["gone"].as_u64()), (Some(0), Some(0)));
        assert!(changed["changed"].as_u64().unwrap() > 0);
        assert_eq!(
            changed["tiles"].as_array().unwrap().len() as u64,
            changed["tiles_changed"].as_u64().unwrap()
        );
        let same = output(&["diff", map, map]);
        assert!(
            same.contains("0 appeared, 0 removed, 0 changed") && same.contains("0 in value only"),
            "{same}"
        );

        let printed = output(&["revert", map, "good", "--keep-as", "bad"]);
        assert!(
            printed.contains("reverted  to good: scan 3") && printed.contains("kept as bad"),
            "{printed}"
        );
        assert_eq!(output(&["digest", map]), before);
        assert_eq!(output(&["digest", &format!("{map}@bad")]), after);
        let report = json(&["verify", map, "--json"]);
        assert_eq!((report["whole"].as_bool(), report["snapshots"].as_u64()), (Some(true), Some(2)));
        assert_eq!(json(&["revert", map, "bad", "--json"])["scan_number_before"], 3);
        assert_eq!(output(&["digest", map]), after);
        assert!(output(&["snapshot", map, "bad", "--delete"]).contains("deleted   bad"));
        output(&["snapshot", map, "good", "--delete"]);
        assert_eq!(output(&["snapshots", map]), "no snapshots\n");
        fs::remove_dir_all(map).unwrap();
    }
}

#[test]
fn wrong_snapshot_names_are_reported() {
    let folder = TempDir::new().unwrap();
    let (scans, map) = (scans(&folder), folder.path().join("map"));
    output(&["build", text(&scans), "-o", text(&map)]);
    let map = text(&map);
    output(&["snapshot", map, "a"]);
    let (past, present) = (format!("{map}@none"), format!("{map}@a"));
    for (arguments, message) in [
        (&["snapshot", map, "now"][..], "is not a valid snapshot name"),
        (&["snapshot", map, "../a"], "is not a valid snapshot name"),
        (&["snapshot", map, "b", "--delete"], "lists them"),
        (&["revert", map, "b"], "lists them"),
        (&["digest", &past], "has no snapshot none"),
        (&["diff", map, "a", "b"], "has no snapshot b"),
        (&["clear", &present, "--region", "0", "0", "0", "1", "1", "1"], "is a snapshot, which is read-only"),
        (&["decay", &present, "--halflife", "10"], "is a snapshot, which is read-only"),
        (&["verify", &present], "is a snapshot, which is read-only"),
        (&["convert", map, "-o", &present, "--storage", "compact"], "is a snapshot, which is read-only"),
        (&["build", text(&scans), "-o", &present], "is a snapshot, which is read-only"),
    ] {
        let (code, printed) = failure(arguments);
        assert_eq!(code, 2, "{arguments:?}: {printed}");
        assert!(printed.contains(message), "{arguments:?}: {printed}");
    }
    // A snapshot of the same state with this name is no error: an earlier call may have been killed.
    assert!(output(&["snapshot", map, "a"]).contains("already existed"));
    assert!(output(&["revert", map, "a", "--keep-as", "a"]).contains("the map already equals a"));
    output(&["clear", map, "--region", "0", "0", "0", "1", "1", "1"]);
    for arguments in [&["snapshot", map, "a"][..], &["revert", map, "a", "--keep-as", "a"]] {
        let (code, printed) = failure(arguments);
        assert!(code == 2 && printed.contains("delete that snapshot first"), "{printed}");
    }
    let other = folder.path().join("other");
    output(&["build", text(&scans), "-o", text(&other), "--resolution", "0.2"]);
    let (code, printed) = failure(&["diff", map, text(&other)]);
    assert_eq!(code, 2);
    assert!(printed.contains("resolution 0.2 m, not 0.1 m"), "{printed}");
    // A folder named `odd@a` takes precedence over a snapshot `a` of the map `odd`.
    let odd = folder.path().join("odd@a");
    fs::rename(text(&other), &odd).unwrap();
    assert_eq!(json(&["info", text(&odd), "--json"])["resolution_m"], 0.2);
}
