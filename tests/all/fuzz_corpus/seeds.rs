//! Small valid files of every format, as seeds for fuzzing.

use super::targets::{TILES, compact_bytes, entries_end, grid};
use crate::readers::{graph, pcd, points};
use std::fs;
use tempfile::TempDir;
use voxtile::octree::{Octree, write_bt, write_bt_unpruned, write_ot};
use voxtile::sensor::Evidence;
use voxtile::space::{BrickCode, Grid, MortonCode, TileIndex, VoxelKey};
use voxtile::store::{Layout, TileFile};
use voxtile::tile::Table;
use voxtile::tile::format::{Trailer, write_compact_file};
use voxtile::{MapConfig, Mapper, OutOfCoreTileMapper, Scan};
use voxtile_formats::ScanStreamWriter;
use voxtile_share::codec::{DigestEntry, Header, Packet, Request, Status, Update};
use voxtile_share::{SetRange, VoxelSet, write_layer};

/// Target, name and content of seeds.
pub type Seeds = Vec<(&'static str, &'static str, Vec<u8>)>;

/// Returns the seeds of all targets.
pub fn all() -> Seeds {
    [octrees(), map_files(), compact_tables(), clouds(), scans(), texts(), shared()].concat()
}

fn octrees() -> Seeds {
    let voxel = |x: u16, y: u16, z: u16, value| (VoxelKey([32768 + x, 32768 + y, 32768 + z]).morton(), value);
    let few = Octree::from_sorted([voxel(0, 0, 0, 1.5), voxel(1, 0, 0, -0.5), voxel(0, 1, 0, 0.0)]);
    let cubes = Octree::from_sorted((0..72).map(|code| (MortonCode(code), 1.0 + (code / 8) as f32)));
    let bt = |tree| {
        let mut bytes = Vec::new();
        write_bt(tree, 0.1, 0.0, &mut bytes).unwrap();
        bytes
    };
    let ot = |tree| {
        let mut bytes = Vec::new();
        write_ot(tree, 0.1, &mut bytes).unwrap();
        bytes
    };
    let mut unpruned = Vec::new();
    write_bt_unpruned(&cubes, 0.05, 0.0, &mut unpruned).unwrap();
    let legacy = [&3_i32.to_le_bytes()[..], &0.25_f64.to_le_bytes(), &3_u32.to_le_bytes(), &[2, 64]].concat();
    let node = |value: f32, mask| [value.to_le_bytes().as_slice(), b"RGB", &[mask]].concat();
    let colored = [
        b"# Octomap OcTree file\nid ColorOcTree\nsize 2\nres 1\ndata\n".to_vec(),
        node(2.0, 4),
        node(-1.0, 0),
    ];
    let world = b"# Octomap OcTree binary file\nres 1e-05 id 1\nsize 1\n#\ndata\n\0\0";
    vec![
        ("bt", "empty", bt(&Octree::new())),
        ("bt", "few", bt(&few)),
        ("bt", "unpruned", unpruned),
        ("bt", "legacy", legacy),
        ("bt", "world", world.to_vec()),
        ("ot", "empty", ot(&Octree::new())),
        ("ot", "few", ot(&few)),
        ("ot", "cubes", ot(&cubes)),
        ("ot", "colored", colored.concat()),
    ]
}

/// Files of a map of two scans, each in its own tile and flush. The first byte is the option byte of targets with
/// checksums.
fn map_files() -> Seeds {
    let folder = TempDir::new().unwrap();
    let folder = folder.path().join("map");
    let grid = grid();
    let config = MapConfig::new(grid.resolution_m(), grid.tile_size_m()).unwrap().with_range(0.0, 1.0);
    let mut mapper = OutOfCoreTileMapper::create(&folder, config).unwrap();
    mapper.begin_input("a \"name\"\n").unwrap();
    let layout = Layout::new(&folder);
    let read = |path| fs::read(path).unwrap();
    let empty = read(layout.metadata());
    for tile in &TILES[..2] {
        let origin = tile.to_array().map(|index| (f64::from(index) + 0.5) * grid.tile_size_m());
        let [x, y, z] = origin;
        let points = vec![[x + 0.3, y, z], [x, y - 0.2, z + 0.2]];
        mapper.insert_scan(&Scan { origin, points, intensities: None }).unwrap();
        mapper.flush().unwrap();
    }
    let table = |tile: TileIndex| read(layout.current(tile, TileFile::Table));
    let (first, second) = (table(TILES[0]), table(TILES[1]));
    let seeds_own = &first[..entries_end(&first).expect("a whole table")];
    let metadata = read(layout.metadata());
    let old = br#"{"version": "1.0", "resolution": 0.05, "tile_size": 10.0, "bounds": {"min": [0, -1, 0], "max": [5, 3, 2]}}"#;
    let log = read(layout.commit_log());
    let chosen = |choice: u8, bytes: &[u8]| [&[choice], bytes].concat();
    vec![
        ("table", "sealed", chosen(1, &first)),
        ("table", "plain", chosen(0, &first)),
        ("table", "other-tile", chosen(3, &second)),
        ("table", "no-trailer", chosen(0, seeds_own)),
        ("metadata", "sealed", chosen(1, &metadata)),
        ("metadata", "plain", chosen(0, &metadata)),
        ("metadata", "empty", chosen(1, &empty)),
        ("metadata", "no-ext", chosen(0, old)),
        ("commit_log", "sealed", chosen(1, &log)),
        ("commit_log", "plain", chosen(0, &log)),
        ("commit_log", "torn", chosen(1, &log[..log.len() - 1])),
        ("commit_log", "zeros", chosen(1, &[&log, &[0; 16][..]].concat())),
    ]
}

/// Tables of version 2; the corpus keeps those of version 1. One without voxels, one with symbols and rare states of
/// every kind, and one with a brick of a single state.
fn compact_tables() -> Seeds {
    let first = grid().voxels_of_tile(TILES[0]).min;
    let brick = |x: i32| BrickCode::of_voxel([first[0] + 8 * x, first[1], first[2]]);
    let state = |log_odds, observation_count| Evidence { log_odds, observation_count };
    let (mut some, mut full) = (Table::default(), Table::default());
    for x in 0..3 {
        // The first two bricks share their states, so symbols take one or two bytes; the third brick has its own
        // states.
        let voxels = (0..400).map(|place| (place, state(f64::from(x / 2 * 350 + place as i32), x / 2)));
        some.insert(brick(x), &voxels.collect::<Vec<_>>());
    }
    full.insert(brick(3), &(0..512).map(|place| (place, state(-0.5, 7))).collect::<Vec<_>>());
    let chosen = |choice: u8, table| [&[choice], &compact_bytes(table)[..]].concat();
    let file = |choice: u8, table| {
        let (tile, scan_number, parameters) = (TILES[0], 12, "{\"resolution\":0.1}".to_owned());
        let (table_crc, octree_crc, octree_bytes) = (0, 0, 0);
        let front =
            Trailer { map_id: [7; 16], tile, scan_number, table_crc, octree_crc, octree_bytes, parameters };
        let mut file = vec![choice];
        write_compact_file(&compact_bytes(table), &[], front, &mut file).unwrap();
        file
    };
    vec![
        ("compact_file", "2-empty", file(1, &Table::default())),
        ("compact_file", "2-some", file(1, &some)),
        ("compact_file", "2-plain", file(0, &full)),
        ("compact", "2-empty", chosen(1, &Table::default())),
        ("compact", "2-some", chosen(1, &some)),
        ("compact", "2-full", chosen(1, &full)),
        ("compact", "2-plain", chosen(0, &full)),
    ]
}

fn clouds() -> Seeds {
    let types = b"FIELDS i _ z y x\nSIZE 2 1 8 4 4\nTYPE U U F I F\nCOUNT 1 3 1 1 1\nWIDTH 1\nHEIGHT 1\nDATA binary\n";
    let columns = b"COLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS 8\nDATA binary_compressed\n";
    // Sizes, then 96 zeros: a literal and two copies of preceding bytes.
    let packed = [7, 0, 0, 0, 96, 0, 0, 0, 0, 0, 7 << 5, 81, 0, 3 << 5, 0];
    vec![
        ("pcd", "ascii", pcd("ascii", &points(2))),
        ("pcd", "binary", pcd("binary", &points(2))),
        ("pcd", "literal", pcd("binary_compressed", &points(2))),
        ("pcd", "packed", [&columns[..], &packed].concat()),
        ("pcd", "types", [&types[..], &[1; 21]].concat()),
    ]
}

fn scans() -> Seeds {
    let log = "# a log\nNODE 10 0 1 0 0 1.2\n1 2 3\n-1 0.5 0.25\n\n skipped\nNODE 0 0 0 0.1 -3 0\n";
    let no_points = [&1_u32.to_le_bytes(), &[0; 4], &graph()[64..132]].concat();
    vec![
        ("graph", "two", graph()),
        ("graph", "no-points", no_points),
        ("log", "two", log.into()),
        ("scan_stream", "intensities", scan_stream("two scans", true)),
        ("scan_stream", "bare", scan_stream("", false)),
    ]
}

fn scan_stream(label: &str, has_intensities: bool) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut writer = ScanStreamWriter::new(&mut bytes, label, has_intensities).unwrap();
    for count in [2, 0] {
        let scan = Scan {
            origin: [1.0, -2.0, 0.5],
            points: vec![[1.5, 2.0, 3.0]; count],
            intensities: Some(vec![7.0; count]),
        };
        writer.write_world(&scan).unwrap();
    }
    bytes
}

fn shared() -> Seeds {
    let header = Header { epoch: 1, sequence: 3 };
    let update = |voxel, is_in| Update { voxel, is_in };
    let updates = vec![update([1, 2, 3], true), update([1, 2, 4], false), update([-9, 0, 30], true)];
    let range = SetRange::of_tiles(TileIndex::new(0, 0, 0), TileIndex::new(0, 3, -1));
    let entry = DigestEntry { last: TileIndex::new(5, 0, 0), voxels: 3, digest: [1; 8] };
    let (resolution_m, tile_size_m) = (0.1, 0.8);
    let status =
        Status { header, nonce: 7, oldest: 1, resolution_m, tile_size_m, voxels: 2, digest: [2; 32] };
    let packet = |packet: Packet| [vec![0], packet.encode().unwrap()].concat();
    let request = |request: Request| [vec![0], request.encode()].concat();
    let mut layer = VoxelSet::new(Grid::new(0.1, 0.8).unwrap());
    for x in 0..20 {
        layer.put([x, 2 * x, -x], true);
    }
    let mut file = vec![0];
    write_layer(&mut layer, &mut file).unwrap();
    // Put, wait, send; then a loss, a new sender, a forged packet.
    let life =
        [0, 1, 2, 3, 3, 20, 4, 5, 7, 0, 6, 0, 1, 9, 9, 9, 3, 50, 4, 8, 136, 0, 4, 4, 4, 3, 50, 4, 9, 2, 1, 1];
    vec![
        ("share_packet", "changes", packet(Packet::Changes { header, repaired: vec![1], updates })),
        ("share_packet", "content", packet(Packet::Content { header, range, voxels: vec![[1, 2, 3]] })),
        (
            "share_packet",
            "digests",
            packet(Packet::Digests { header, first: TileIndex::default(), entries: vec![entry] }),
        ),
        ("share_packet", "status", packet(Packet::Status(status))),
        ("share_packet", "ask-missing", request(Request::Missing { epoch: 1, sequences: vec![2, 3] })),
        (
            "share_packet",
            "ask-content",
            request(Request::Content { epoch: 1, ranges: vec![range, SetRange::ALL] }),
        ),
        ("share_packet", "layer", file),
        ("share_life", "short", life.to_vec()),
    ]
}

fn texts() -> Seeds {
    vec![
        ("points", "columns", "1 2 3\n-0.5\t1e3 nan 4\n\n# more\n0 0 0\n".into()),
        ("points", "csv", "x,y,z\n1,2,3\r\n4;5;6\n".into()),
    ]
}
