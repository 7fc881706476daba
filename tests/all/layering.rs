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

/// The modules of ours that the code of a folder or file names, tests left out.
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

/// Every folder and file of the library, and what of ours it may name. Above them is `command/`, which may name all.
const LAYERS: [(&str, &[&str]); 26] = [
    ("maths.rs", &[]),
    ("one_heap.rs", &[]),
    ("path_text.rs", &[]),
    ("scratch.rs", &[]),
    ("error.rs", &["space"]),
    ("error", &["space"]),
    ("space", &[]),
    ("sensor", &["error", "maths"]),
    ("config.rs", &["error", "maths", "sensor", "space"]),
    ("config", &["error"]),
    ("scan", &["config", "error", "scratch", "sensor", "space"]),
    ("octree", &["error", "space"]),
    ("tile", &["config", "error", "octree", "scan", "sensor", "space"]),
    ("store", &["config", "error", "scratch", "sensor", "space"]),
    // The one layer that knows both tiles and files.
    ("persistence", &["config", "error", "sensor", "space", "store", "tile"]),
    ("mapper", &["config", "error", "octree", "persistence", "scan", "sensor", "space", "store", "tile"]),
    ("query", &["config", "error", "mapper", "maths", "octree", "scan", "sensor", "space", "store", "tile"]),
    ("io", &["error", "maths", "scan", "space"]),
    // Voxels of an archive by the interface of mappers and queries alone.
    ("local", &["error", "mapper", "maths", "query", "scan", "sensor", "space"]),
    // No transport, file or clock; of the configuration which rays a map takes.
    ("share", &["config", "error", "local", "mapper", "maths", "query", "scan", "space"]),
    // Whole maps on disk, tile by tile.
    (
        "operations",
        &["config", "error", "mapper", "maths", "persistence", "scan", "sensor", "space", "store", "tile"],
    ),
    // Maps in a bucket: their files, and no tile's content.
    ("bucket", &["error", "scratch", "space", "store"]),
    ("integrity", &["config", "error", "path_text", "persistence", "space", "store", "tile"]),
    // Maps to look at, by the interface of mappers: no web, no screen, no file.
    (
        "render",
        &["config", "error", "local", "mapper", "query", "scan", "scratch", "sensor", "space", "tile"],
    ),
    ("simulation", &["maths", "scan", "space"]),
    // It explains, and names what callers use.
    ("lib.rs", &["config", "error", "mapper", "query", "scan", "sensor", "space", "store", "tile"]),
];

#[test]
fn every_folder_knows_only_what_lies_before_it_in_the_flow() {
    for (layer, allowed) in LAYERS {
        let own = layer.trim_end_matches(".rs");
        for (path, name) in uses(layer) {
            assert!(name == own || allowed.contains(&name.as_str()), "{} uses {name}", path.display());
        }
    }
    // A codec knows no state.
    for (path, name) in uses("share/codec") {
        assert!(["error", "share", "space"].contains(&name.as_str()), "{} uses {name}", path.display());
    }
}

#[test]
fn every_folder_has_its_place_in_the_flow() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(src).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            ["bin", "command"].contains(&&*name) || LAYERS.iter().any(|(layer, _)| *layer == name),
            "src/{name} has no layer"
        );
    }
}

#[test]
fn only_the_disk_touches_a_maps_files_and_nothing_below_the_command_prints_or_exits() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for path in sources(&root).into_iter().filter(|path| !path.starts_with(root.join("command"))) {
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
