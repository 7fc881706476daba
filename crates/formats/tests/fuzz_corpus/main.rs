//! Runs the fuzz targets on the corpus of `fuzz/`. `fuzz/run.sh` searches for new inputs.
#![cfg(all(feature = "las", feature = "e57", feature = "ros"))]

#[path = "../made/mod.rs"]
mod made;
mod seeds;
mod targets;

use std::fs;
use std::path::{Path, PathBuf};
use targets::TARGETS;
use voxtile_formats::Registry;

fn corpus(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fuzz/corpus").join(target)
}

#[test]
fn corpus_files_break_no_reader() {
    for (name, target) in TARGETS {
        let folder = corpus(name);
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{} is empty", folder.display());
        for path in files {
            // Print the name of the file, in case the next line panics.
            println!("{}", path.display());
            target(&fs::read(&path).unwrap());
        }
    }
}

/// Formats and their corpora. Depth images are excluded: the crate png decodes them, and their lists contain only
/// stamps and file names.
const CORPORA: [(&str, &str); 15] = [
    ("pcd", "pcd"),
    ("ply", "cloud_ply"),
    ("xyz", "cloud_text"),
    ("bin", "cloud_bin"),
    ("las", "cloud_las"),
    ("laz", "cloud_las"),
    ("copc", "cloud_las"),
    ("e57", "cloud_e57"),
    ("bag", "ros_bag1"),
    ("mcap", "ros_mcap"),
    ("db3", "ros_messages"),
    ("rosbag2", "ros_metadata"),
    ("graph", "graph"),
    ("log", "log"),
    ("scans", "scan_stream"),
];

#[test]
fn every_format_is_fuzzed() {
    for format in Registry::default().formats() {
        let found = CORPORA.iter().find(|(name, _)| *name == format.name);
        match found {
            Some((_, target)) => assert!(corpus(target).is_dir(), "{target}"),
            None => {
                assert!(["tum-rgbd", "depth"].contains(&format.name), "{} has no fuzz target", format.name)
            }
        }
    }
}

#[test]
fn every_seed_is_a_valid_file() {
    for (target, name, bytes) in seeds::all() {
        let (_, read) = TARGETS.iter().find(|(of, _)| *of == target).expect("a seed is of a target");
        assert!(read(&bytes), "{target} {name}");
    }
}

#[test]
#[ignore = "writes into the repository: cargo test --test fuzz_corpus write_the_seeds -- --ignored"]
fn write_the_seeds() {
    for (target, name, bytes) in seeds::all() {
        fs::create_dir_all(corpus(target)).unwrap();
        fs::write(corpus(target).join(format!("seed-{name}")), bytes).unwrap();
    }
}
