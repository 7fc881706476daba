//! Runs the corpus of `fuzz/` through the bodies of its targets. `fuzz/run.sh` searches for new inputs.

mod seeds;
mod targets;

use std::fs;
use std::path::{Path, PathBuf};
use targets::TARGETS;

fn corpus(target: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target)
}

#[test]
fn readers_survive_every_file_of_the_corpus() {
    for (name, target) in TARGETS {
        let folder = corpus(name);
        let entries = fs::read_dir(&folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        let files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
        assert!(!files.is_empty(), "{} is empty", folder.display());
        let mut is_one_read = false;
        for path in files {
            // Names the file if the next line panics.
            println!("{}", path.display());
            is_one_read |= target(&fs::read(&path).unwrap());
        }
        assert!(is_one_read, "no file in {} is read: run write_the_seeds again", folder.display());
    }
}

#[test]
fn every_seed_is_a_valid_file() {
    for (target, name, bytes) in seeds::all() {
        let (_, read) = TARGETS.iter().find(|(of, _)| *of == target).expect("each seed names a target");
        assert!(read(&bytes), "{target} {name}");
    }
}

#[test]
#[ignore = "writes into the repository: cargo test --test all write_the_seeds -- --ignored"]
fn write_the_seeds() {
    for (target, name, bytes) in seeds::all() {
        fs::create_dir_all(corpus(target)).unwrap();
        fs::write(corpus(target).join(format!("seed-{name}")), bytes).unwrap();
    }
}
