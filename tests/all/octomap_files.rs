use crate::support::data;
use crate::support::random_scans::Random;
use voxtile::octree::{Octree, OctreeFormat, read_octree, write_bt, write_ot};
use voxtile::space::MortonCode;

fn written(tree: &Octree, resolution_m: f64, format: OctreeFormat) -> Vec<u8> {
    let mut bytes = Vec::new();
    match format {
        OctreeFormat::Binary => write_bt(tree, resolution_m, 0.0, &mut bytes).unwrap(),
        OctreeFormat::Full => write_ot(tree, resolution_m, &mut bytes).unwrap(),
    }
    bytes
}

/// From the line `data` on: comments in the header are free.
fn payload(file: &[u8]) -> &[u8] {
    let at = file.windows(6).position(|window| window == b"\ndata\n").unwrap();
    &file[at..]
}

#[test]
fn real_maps_are_read_to_the_last_node_and_written_back_byte_for_byte() {
    let Some(folder) = data("octomap_maps") else { return };
    let mut count = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.extension().is_some_and(|extension| extension == "bt" || extension == "ot") {
            continue;
        }
        let bytes = std::fs::read(&path).unwrap();
        let mut rest = &bytes[..];
        let file = read_octree(&mut rest).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        assert!(rest.is_empty(), "{}: {} bytes left", path.display(), rest.len());
        let again = written(&file.tree, file.resolution_m, file.format);
        assert!(payload(&again) == payload(&bytes), "{} differs", path.display());
        count += 1;
    }
    assert!(count > 0);
}

#[test]
fn geb079_has_the_counts_that_octomap_reports() {
    let Some(folder) = data("octomap_maps") else { return };
    let file = read_octree(&*std::fs::read(folder.join("geb079.bt")).unwrap()).unwrap();
    assert_eq!((file.tree.len_nodes(), file.tree.len_leaves(), file.resolution_m), (532_566, 428_144, 0.08));
    let full = read_octree(&*std::fs::read(folder.join("geb079_from_pyoctomap.ot")).unwrap()).unwrap();
    assert!(full.tree.leaves().eq(file.tree.leaves()));
}

/// One voxel occupied, its neighbour free, and a cube of eight equal ones beside them.
fn small_tree() -> Octree {
    let mut tree = Octree::new();
    tree.set(MortonCode(0), 0.5);
    tree.set(MortonCode(1), -0.5);
    (8..16).for_each(|code| tree.set(MortonCode(code), 2.0));
    tree
}

#[test]
fn a_small_tree_has_these_bytes() {
    let head = |magic: &str, nodes: usize| {
        format!(
            "{magic}\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid OcTree\nsize \
             {nodes}\nres 0.1\ndata\n"
        )
    };
    let mut bt = head("# Octomap OcTree binary file", 19).into_bytes();
    // Fourteen nodes with one inner child 0, then one with an inner and an occupied child, then the two voxels.
    (0..14).for_each(|_| bt.extend([0b11, 0]));
    bt.extend([0b1011, 0, 0b0110, 0]);
    assert_eq!(written(&small_tree(), 0.1, OctreeFormat::Binary), bt);

    let mut ot = head("# Octomap OcTree file", 19).into_bytes();
    let mut node = |log_odds: f32, mask: u8| {
        ot.extend(log_odds.to_le_bytes());
        ot.push(mask);
    };
    (0..14).for_each(|_| node(2.0, 0b1));
    [(2.0, 0b11), (0.5, 0b11), (0.5, 0), (-0.5, 0), (2.0, 0)]
        .into_iter()
        .for_each(|(value, mask)| node(value, mask));
    assert_eq!(written(&small_tree(), 0.1, OctreeFormat::Full), ot);
    let file = read_octree(&*ot).unwrap();
    assert!(file.tree.leaves().eq(small_tree().leaves()));
    assert_eq!(file.tree.len_nodes(), small_tree().len_nodes());
}

#[test]
fn headers_are_read_as_octomap_reads_them() {
    let bt = written(&small_tree(), 0.1, OctreeFormat::Binary);
    let with_header = |header: &str| {
        let mut file = format!("# Octomap OcTree binary file\n{header}").into_bytes();
        file.extend_from_slice(&payload(&bt)[1..]);
        file
    };
    for header in [
        "res 0.1\nsize 19\nid OcTree\n",
        "# words id size\nid 1\nres 0.1\ncolor blue and green\nsize 19\n",
        "id OcTree size 19 res 0.1\n",
    ] {
        let file = read_octree(&*with_header(header)).unwrap();
        assert!(file.tree.leaves().count() == 3 && file.resolution_m == 0.1, "{header}");
    }
    let mut legacy = 3_i32.to_le_bytes().to_vec();
    legacy.extend(0.25_f64.to_le_bytes());
    legacy.extend(19_u32.to_le_bytes());
    legacy.extend_from_slice(&payload(&bt)[6..]);
    let file = read_octree(&*legacy).unwrap();
    assert_eq!((file.tree.len_leaves(), file.resolution_m), (3, 0.25));
    let empty = written(&Octree::new(), 0.2, OctreeFormat::Binary);
    assert!(read_octree(&*empty).unwrap().tree.is_empty());

    for (header, message) in [
        ("id OcTree\nsize 18\nres 0.1\n", "the header says 18 nodes, the tree has 19"),
        ("id OcTree\nsize 19\nres -1\n", "is not a positive length"),
        ("id OcTree\nsize 19\nres NaN\n", "is not a positive length"),
        ("id CountingOcTree\nsize 19\nres 0.1\n", "a tree of type `CountingOcTree`"),
        ("id OcTree\nsize many\nres 0.1\n", "`size many` is not a number"),
    ] {
        let error = read_octree(&*with_header(header)).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
    assert!(read_octree(&b"# nonsense\n"[..]).unwrap_err().to_string().contains("offset 0"));
}

#[test]
fn hostile_files_are_errors_and_never_more() {
    let deep: Vec<u8> = [0xff_u8; 4000].to_vec();
    let header = "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.1\ndata\n";
    let error = read_octree(&*[header.as_bytes(), &deep].concat()).unwrap_err().to_string();
    assert!(error.contains("below the finest depth"), "{error}");

    // All of space free: eight leaves of 2^45 voxels each, in two bytes.
    let bomb = read_octree(&*[header.as_bytes(), &[0x55, 0x55]].concat()).unwrap();
    assert_eq!(bomb.tree.expanded_voxels(0.0), (1 << 48, 0));

    let mut random = Random(8);
    for format in [OctreeFormat::Binary, OctreeFormat::Full] {
        let good = written(&small_tree(), 0.1, format);
        for length in 0..good.len() {
            assert!(read_octree(&good[..length]).is_err(), "cut to {length} bytes");
        }
        for _ in 0..20_000 {
            let mut bytes = good.clone();
            for _ in 0..1 + random.below(4) {
                let at = random.below(bytes.len() as u64) as usize;
                bytes[at] = random.next() as u8;
            }
            if let Ok(file) = read_octree(&*bytes) {
                file.tree.expanded_voxels(0.0);
                written(&file.tree, file.resolution_m, OctreeFormat::Binary);
                written(&file.tree, file.resolution_m, OctreeFormat::Full);
            }
        }
    }
}
