use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path) -> Vec<PathBuf> {
    if folder.is_file() {
        return vec![folder.to_owned()];
    }
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let files = entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] });
    files.filter(|path| path.extension().is_some_and(|extension| extension == "rs")).collect()
}

/// Returns the engine's modules that a folder or file uses, tests excluded.
fn uses(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src").join(folder);
    let mut edges = Vec::new();
    for path in sources(&root).into_iter().filter(|path| !path.ends_with("tests.rs")) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        for line in code.lines().filter(|line| !line.trim_start().starts_with("//")) {
            // Macros are expanded elsewhere.
            for part in line.replace("$crate::", "").split("crate::").skip(1) {
                let name: String = part.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
                edges.push((path.clone(), name));
            }
        }
    }
    edges
}

/// Folders and files of the engine, each with the modules that it may use. Dependencies between crates are in their
/// manifests.
const LAYERS: [(&str, &[&str]); 19] = [
    ("maths.rs", &[]),
    ("one_heap.rs", &[]),
    ("path_text.rs", &[]),
    ("scratch.rs", &[]),
    ("error.rs", &["space"]),
    ("error", &["space"]),
    ("space", &[]),
    ("sensor", &["error", "maths", "space"]),
    ("config.rs", &["error", "maths", "sensor", "space"]),
    ("config", &["error"]),
    ("scan", &["config", "error", "scratch", "sensor", "space"]),
    ("octree", &["error", "space"]),
    ("tile", &["config", "error", "octree", "scan", "sensor", "space"]),
    ("store", &["config", "error", "scratch", "sensor", "space"]),
    // The only layer that uses both tiles and files.
    ("persistence", &["config", "error", "scan", "sensor", "space", "store", "tile"]),
    ("mapper", &["config", "error", "octree", "persistence", "scan", "sensor", "space", "store", "tile"]),
    ("query", &["config", "error", "mapper", "maths", "octree", "scan", "sensor", "space", "store", "tile"]),
    // Operations on whole maps on disk, tile by tile.
    (
        "operations",
        &["config", "error", "mapper", "maths", "persistence", "scan", "sensor", "space", "store", "tile"],
    ),
    ("integrity", &["config", "error", "path_text", "persistence", "space", "store", "tile"]),
];

#[test]
fn modules_only_use_lower_layers() {
    for (layer, allowed) in LAYERS {
        let own = layer.trim_end_matches(".rs");
        for (path, name) in uses(layer) {
            assert!(name == own || allowed.contains(&name.as_str()), "{} uses {name}", path.display());
        }
    }
}

#[test]
fn every_module_has_a_layer() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(src).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            name == "lib.rs" || LAYERS.iter().any(|(layer, _)| *layer == name),
            "src/{name} has no layer"
        );
    }
}

#[test]
fn only_the_disk_uses_the_file_system_and_the_engine_does_not_print_or_exit() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root) {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap();
        let is_disk = path.ends_with("store/fs_disk.rs");
        for word in ["std::fs", "File::open", "File::create"] {
            assert!(is_disk || !code.contains(word), "{} has {word}", path.display());
        }
        for word in ["println!", "eprintln!", "process::exit"] {
            assert!(!code.contains(word), "{} has {word}", path.display());
        }
    }
}
