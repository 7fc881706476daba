use crate::cli::{failure, json, output, scans, text};
use std::fs;
use tempfile::TempDir;

#[test]
fn local_prints_a_table_and_draws_a_picture() {
    let folder = TempDir::new().unwrap();
    let (scans, picture) = (scans(&folder), folder.path().join("local.png"));
    let row = json(&["local", text(&scans), "-o", text(&picture), "--json"]);
    assert_eq!((row["setup"].as_str(), row["scans"].as_u64()), (Some("local"), Some(3)));
    // A wall of 40 points, 0.1 m apart; every scan has an invalid point and one at the sensor.
    assert_eq!((row["n_occ"].as_u64(), row["skipped"].as_u64()), (Some(40), Some(6)));
    assert!(row["n_inf"].as_f64().unwrap() > 40.0 && row["bytes"].as_u64().unwrap() > 0);
    assert!(fs::read(&picture).unwrap().starts_with(b"\x89PNG"));

    let limited = json(&["local", text(&scans), "-o", text(&picture), "--json", "--n-lim", "7"]);
    assert_eq!(limited["n_occ"].as_u64(), Some(7));
    let near = json(&["local", text(&scans), "-o", text(&picture), "--json", "--d-inf", "0"]);
    assert_eq!(near["n_inf"].as_f64(), Some(0.0));
    let few =
        json(&["local", text(&scans), "-o", text(&picture), "--json", "--points", "10", "--d-in", "inf"]);
    assert_eq!(few["points"].as_u64(), Some(30));

    let twice = json(&["local", text(&scans), "-o", text(&picture), "--json", "--repeat", "2"]);
    assert_eq!((twice["scans"].as_u64(), twice["n_occ"].as_u64()), (Some(3), Some(40)));

    let table = output(&["local", text(&scans), "-o", text(&picture), "--preset", "passive"]);
    let columns: Vec<Vec<&str>> = table.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!((columns[0][0], columns[0][4]), ("setup", "n_occ"));
    assert_eq!((columns[1][0], columns[1][4]), ("passive", "40"));
}

#[test]
fn wrong_parameters_are_refused_without_a_picture() {
    let folder = TempDir::new().unwrap();
    let (scans, picture) = (scans(&folder), folder.path().join("local.png"));
    for wrong in [["--radius", "5"], ["--d-in", "-1"], ["--p-init", "1"], ["--resolution", "0"]] {
        let (code, message) = failure(&["local", text(&scans), "-o", text(&picture), wrong[0], wrong[1]]);
        assert_eq!(code, 2, "{message}");
        assert!(!picture.exists());
    }
    assert_eq!(failure(&["local", text(&scans), "--preset", "other"]).0, 2);
    assert_eq!(failure(&["local", "no/such/folder"]).0, 2);
}
