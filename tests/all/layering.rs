use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] });
    files.filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

/// The modules of ours that the code of a folder names, tests left out.
fn uses(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder);
    let mut edges = Vec::new();
    for path in sources(&root).into_iter().filter(|path| !path.ends_with("tests.rs")) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            for part in line.split("crate::").skip(1) {
                let name: String = part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                edges.push((path.clone(), name));
            }
        }
    }
    edges
}

#[test]
fn the_folders_know_only_what_lies_before_them_in_the_flow() {
    let allowed: [(&str, &[&str]); 12] = [
        ("space", &[]),
        ("sensor", &["error", "maths"]),
        ("scan", &["config", "error", "scratch", "sensor", "space"]),
        ("octree", &["error", "space"]),
        ("tile", &["config", "error", "octree", "scan", "sensor", "space"]),
        ("store", &["config", "error", "scratch", "sensor", "space"]),
        ("io", &["error", "maths", "scan", "space"]),
        // Voxels of an archive by the interface of mappers and questions alone.
        ("local", &["error", "mapper", "maths", "query", "scan", "sensor", "space"]),
        // A codec knows no state, and a share no transport, file or clock.
        ("share/codec", &["error", "share", "space"]),
        ("share", &["error", "local", "mapper", "maths", "query", "scan", "space"]),
        // Whole maps on disk, tile by tile.
        ("session", &["config", "error", "mapper", "maths", "sensor", "space", "store", "tile"]),
        ("simulation", &["maths", "scan", "space"]),
    ];
    for (folder, allowed) in allowed {
        for (path, name) in uses(folder) {
            assert!(name == folder || allowed.contains(&name.as_str()), "{} uses {name}", path.display());
        }
    }
}

#[test]
fn only_the_disk_touches_a_maps_files_and_nothing_below_the_command_prints_or_exits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root).into_iter().filter(|path| !path.starts_with(root.join("bin"))) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let reads_inputs = path.starts_with(root.join("io"));
        let is_disk = path.ends_with("store/fs_disk.rs");
        for word in ["std::fs", "File::open", "File::create"] {
            assert!(reads_inputs || is_disk || !code.contains(word), "{} has {word}", path.display());
        }
        for word in ["println!", "eprintln!", "process::exit"] {
            assert!(!code.contains(word), "{} has {word}", path.display());
        }
    }
}
