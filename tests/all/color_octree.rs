//! Files of OctoMap's `ColorOcTree`, compared with a naive writer.

use std::collections::BTreeMap;
use std::io::Cursor;
use testkit::random_scans::{Random, random_scan};
use voxtile::octree::{BrickValues, NodeColour, OctreeFormat, OctreeStream, read};
use voxtile::query::OctreeExport;
use voxtile::scan::ScanRef;
use voxtile::space::{MortonCode, VoxelKey};
use voxtile::{InMemoryMapper, Layers, MapConfig, MapQueries, MapView, Mapper, PointAttributes};

type Colour = [u8; 3];
type Voxels = BTreeMap<MortonCode, (f32, Colour)>;

const WHITE: Colour = [255; 3];

/// Node with the bytes of its descendants.
struct Node {
    value: f32,
    colour: Colour,
    is_leaf: bool,
    nodes: u64,
    bytes: Vec<u8>,
}

impl Node {
    fn new(value: f32, colour: Colour, known: u8, below: &[Self]) -> Self {
        let mut bytes = [&value.to_le_bytes()[..], &colour, &[known]].concat();
        below.iter().for_each(|child| bytes.extend(&child.bytes));
        let nodes = 1 + below.iter().map(|child| child.nodes).sum::<u64>();
        Self { value, colour, is_leaf: below.is_empty(), nodes, bytes }
    }
}

/// Returns the node at `depth` from a voxel on.
fn node_of(voxels: &Voxels, first: u64, depth: u8) -> Option<Node> {
    let found = voxels.range(MortonCode(first)..MortonCode(first + MortonCode::span(depth))).next()?;
    if depth == 16 {
        return Some(Node::new(found.1.0, found.1.1, 0, &[]));
    }
    let children =
        (0..8).map(|child| node_of(voxels, first + child * MortonCode::span(depth + 1), depth + 1));
    let children: Vec<Option<Node>> = children.collect();
    let known = (0..8).filter(|&k| children[k].is_some()).fold(0, |mask, k| mask | 1 << k);
    let below: Vec<Node> = children.into_iter().flatten().collect();
    let first = &below[0];
    let is_first = |child: &Node| child.is_leaf && child.value == first.value && child.colour == first.colour;
    if known == 255 && below.iter().all(is_first) {
        return Some(Node::new(first.value, first.colour, 0, &[]));
    }
    let value = below.iter().map(|child| child.value).fold(f32::MIN, f32::max);
    let set: Vec<Colour> = below.iter().map(|child| child.colour).filter(|colour| *colour != WHITE).collect();
    let mean = |k: usize| set.iter().map(|colour| usize::from(colour[k])).sum::<usize>() / set.len();
    let colour = if set.is_empty() { WHITE } else { [0, 1, 2].map(|k| mean(k) as u8) };
    Some(Node::new(value, colour, known, &below))
}

fn file_of(voxels: &Voxels, resolution: &str) -> Vec<u8> {
    let root = node_of(voxels, 0, 0);
    let nodes = root.as_ref().map_or(0, |root| root.nodes);
    let head = format!(
        "# Octomap OcTree file\n# (feel free to add / change comments, but leave the first line as it is!)\n#\nid \
         ColorOcTree\nsize {nodes}\nres {resolution}\ndata\n"
    );
    [head.into_bytes(), root.map_or(Vec::new(), |root| root.bytes)].concat()
}

/// Adds the voxels in blocks of random sizes.
fn add_blocks(
    stream: &mut OctreeStream<&mut Cursor<Vec<u8>>>,
    voxels: &Voxels,
    first: u64,
    depth: u8,
    random: &mut Random,
) {
    let inside = || voxels.range(MortonCode(first)..MortonCode(first + MortonCode::span(depth)));
    if inside().next().is_none() {
        return;
    }
    if depth < 13 && random.below(12) > 0 {
        for child in 0..8 {
            add_blocks(stream, voxels, first + child * MortonCode::span(depth + 1), depth + 1, random);
        }
        return;
    }
    let mut values = BrickValues::with_colours();
    // Each brick in two parts, as on the border of two tiles.
    for part in 0..2 {
        let mine: Vec<_> = inside().filter(|(code, _)| code.0 / 3 % 2 == part).collect();
        for brick in mine.chunk_by(|a, b| a.0.brick() == b.0.brick()) {
            values.begin(brick[0].0.brick());
            for (code, (value, colour)) in brick {
                values.add_coloured(code.place_in_brick(), *value, NodeColour(*colour));
            }
            values.end();
        }
    }
    stream.add_block(MortonCode(first), depth, &mut values).unwrap();
}

#[test]
fn blocks_of_any_size_are_the_naive_file() {
    let mut random = Random(51);
    for round in 0..40 {
        let mut voxels = Voxels::new();
        for _ in 0..random.below(6) {
            let base =
                [0, 0x1234_5678_9a00, 0x1234_5678_0000, MortonCode::END - 4096][random.below(4) as usize];
            let first = base + random.below(4096 - 700);
            let (value, colour) = (random.below(3) as f32 - 1.0, [random.below(256) as u8, 7, 9]);
            let kind = random.below(3);
            voxels.extend((first..first + random.below(700)).map(|code| {
                // Equal voxels, others of equal log-odds, and random ones; some without a colour.
                let colour = match (kind, random.below(4)) {
                    (0, _) => colour,
                    (_, 0) => WHITE,
                    _ => [random.below(4) as u8, random.below(256) as u8, 255],
                };
                let value = if kind < 2 { value } else { random.below(3) as f32 };
                (MortonCode(code), (value, colour))
            }));
        }
        let (mut bytes, mut spool) = (Vec::new(), Cursor::new(Vec::new()));
        let mut stream = OctreeStream::color_ot(&mut spool);
        add_blocks(&mut stream, &voxels, 0, 0, &mut random);
        stream.finish(0.05, &mut bytes).unwrap();
        assert!(bytes == file_of(&voxels, "0.05"), "round {round}");
    }
}

#[test]
fn the_file_of_a_map_has_the_mean_colours_of_its_voxels() {
    let layers = Layers { colour: true, class: true, ..Layers::NONE };
    let config = MapConfig::new(0.1, 1.1).unwrap().with_range(0.0, 5.0);
    let mut map = InMemoryMapper::new(config.clone().with_layers(layers)).unwrap();
    let mut plain = InMemoryMapper::new(config).unwrap();
    let mut random = Random(52);
    for _ in 0..3 {
        let scan = random_scan(&mut random, [0.3, -0.1, 0.2], 150);
        let colours = scan
            .points
            .iter()
            .map(|_| (random.below(5) > 0).then(|| [random.below(256) as u8, random.below(256) as u8, 30]));
        let attributes = PointAttributes { colours: colours.collect(), ..PointAttributes::default() };
        let points = ScanRef::in_world(scan.origin, &scan.points);
        map.insert_points(&points.with_attributes(&attributes).unwrap()).unwrap();
        plain.insert_points(&points).unwrap();
    }
    let grid = map.config().grid;
    let mut voxels = Voxels::new();
    map.for_each_occupied(Some(0.0), None, |voxel| {
        let made = map.layers_at(grid.center_m(voxel.index)).unwrap();
        let colour = made.and_then(|made| made.mean_colour()).unwrap_or(WHITE);
        let value = voxel.evidence.log_odds as f32;
        voxels.insert(VoxelKey::from_index(voxel.index).morton(), (value, colour));
    })
    .unwrap();
    assert!(voxels.values().filter(|(_, colour)| *colour != WHITE).count() > 200);
    let written = |map: &InMemoryMapper, format, memory_bytes, origin| {
        let export = OctreeExport { format, region: None, origin, memory_bytes };
        let (mut spool, mut bytes) = (Cursor::new(Vec::new()), Vec::new());
        map.write_octree::<Box<dyn std::error::Error>>(&export, &mut spool, &mut bytes).unwrap();
        bytes
    };
    for memory_bytes in [0, 3_000, 100_000, usize::MAX] {
        let bytes = written(&map, OctreeFormat::ColorOt, memory_bytes, [0; 3]);
        assert!(bytes == file_of(&voxels, "0.1"), "{memory_bytes} bytes of memory");
        let plain_bytes = written(&plain, OctreeFormat::Ot, memory_bytes, [0; 3]);
        assert!(written(&map, OctreeFormat::Ot, memory_bytes, [0; 3]) == plain_bytes);
    }
    // Moved by whole voxels.
    let shift = [5, -13, 8];
    let moved = voxels.iter().map(|(code, voxel)| {
        let VoxelKey(key) = code.to_key();
        let key = std::array::from_fn(|k| (i32::from(key[k]) - shift[k]) as u16);
        (VoxelKey(key).morton(), *voxel)
    });
    assert!(written(&map, OctreeFormat::ColorOt, 3_000, shift) == file_of(&moved.collect(), "0.1"));
    // Read back, with its log-odds.
    let file = read(written(&map, OctreeFormat::ColorOt, 3_000, [0; 3]).as_slice()).unwrap();
    assert_eq!((file.id.as_str(), file.tree.expanded_leaf_count()), ("ColorOcTree", voxels.len() as u64));
    // A map without the layer has white voxels.
    let white = voxels.iter().map(|(code, (value, _))| (*code, (*value, WHITE))).collect();
    assert!(written(&plain, OctreeFormat::ColorOt, 3_000, [0; 3]) == file_of(&white, "0.1"));
}
