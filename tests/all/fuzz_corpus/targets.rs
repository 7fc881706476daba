//! Bodies of the fuzz targets: any bytes as input to every reader of a format. A reader must not panic, hang or use
//! much memory, and its output must be consistent. The result is whether the input was valid.
//!
//! In formats with checksums the first byte of the input contains options: if its lowest bit is set, the checksums are
//! corrected first, to reach the code after them.

use std::path::Path;
use std::time::Duration;
use voxtile::Pose;
use voxtile::octree::{
    OctreeFile, OctreeFormat, read, read_with_limit, write_bt, write_bt_unpruned, write_ot,
};
use voxtile::space::{Grid, TileIndex, VoxelBox, VoxelKey};
use voxtile::store::{CommitLog, Metadata};
use voxtile::tile::Table;
use voxtile::tile::format::{
    CompactEffort, CompactFileIndex, CompactWriter, TRAILER_BYTES, Trailer, read_compact, read_compact_file,
    read_compact_front, read_table, write_compact, write_compact_file, write_table,
};
use voxtile_formats::{
    ScanSource, SensorScan, read_pcd, read_points, read_scan_graph, read_scan_log, read_scan_stream,
};
use voxtile_share::codec::{Packet, Request};
use voxtile_share::{Receiver, ReceiverConfig, Sender, SenderConfig, read_layer};

pub type Target = fn(&[u8]) -> bool;

/// All targets, by the names of their corpora.
pub const TARGETS: [(&str, Target); 14] = [
    ("bt", octree),
    ("ot", octree),
    ("table", table),
    ("compact", compact),
    ("compact_file", compact_file),
    ("metadata", metadata),
    ("commit_log", commit_log),
    ("pcd", pcd),
    ("graph", graph),
    ("log", log),
    ("scan_stream", scan_stream),
    ("points", points),
    ("share_packet", share_packet),
    ("share_life", share_life),
];

const MAX_TREE_BYTES: usize = 64 << 20;

/// OctoMap's `.bt` and `.ot`: a round trip through the writer gives the same tree.
pub fn octree(data: &[u8]) -> bool {
    let Ok(file) = read_with_limit(data, MAX_TREE_BYTES) else { return false };
    let written = octree_bytes(&file);
    let again = read(written.as_slice()).expect("the written file is valid");
    assert!(again.tree.leaves().eq(file.tree.leaves()));
    assert_eq!(again.tree.node_count(), file.tree.node_count());
    assert_eq!(octree_bytes(&again), written);

    let mut pruned = Vec::new();
    write_bt(&file.tree, file.resolution_m, 0.0, &mut pruned).expect("writes to memory succeed");
    let pruned = read(pruned.as_slice()).expect("the written file is valid").tree;
    assert_eq!(pruned.expanded_leaf_count(), file.tree.expanded_leaf_count());
    let mut normal = file.tree.clone();
    normal.normalize();
    assert_eq!(normal.expanded_leaf_count(), file.tree.expanded_leaf_count());
    let states = file.tree.count_voxels(0.0);
    assert_eq!(normal.count_voxels(0.0), states);
    assert_eq!(states.occupied + states.free, file.tree.expanded_leaf_count());
    // `.bt` has no bits for the state of a lone root.
    if file.tree.node_count() > 1 {
        assert_eq!(pruned.count_voxels(0.0), states);
    }
    true
}

fn octree_bytes(file: &OctreeFile) -> Vec<u8> {
    let mut bytes = Vec::new();
    match file.format {
        OctreeFormat::Bt => write_bt_unpruned(&file.tree, file.resolution_m, 0.0, &mut bytes),
        OctreeFormat::Ot | OctreeFormat::ColorOt => write_ot(&file.tree, file.resolution_m, &mut bytes),
    }
    .expect("writes to memory succeed");
    bytes
}

/// Tiles of the table, selected by two bits of the first byte.
pub const TILES: [TileIndex; 4] = [
    TileIndex::new(0, 0, 0),
    TileIndex::new(-1, 7, -3),
    TileIndex::new(1023, -1024, 2_000_000),
    TileIndex::new(i32::MAX, i32::MIN, 67_108_863),
];

/// Grid of [`TILES`].
pub fn grid() -> Grid {
    Grid::new(0.1, 3.2).expect("32 voxels along a tile")
}

/// `iwlo_meta.bin`: the writer reproduces the input.
pub fn table(data: &[u8]) -> bool {
    let Some((&choice, file)) = data.split_first() else { return false };
    let mut file = file.to_vec();
    if choice & 1 == 1 {
        seal_table(&mut file);
    }
    let voxels = grid().voxels_of_tile(TILES[usize::from(choice >> 1 & 3)]);
    let read = |bytes: &[u8]| read_table(&mut &bytes[..], bytes.len() as u64, &voxels);
    let Ok(decoded) = read(&file) else { return false };
    let end = entries_end(&file).expect("the header is valid");
    let layers_at = end + decoded.trailer.as_ref().map_or(0, |trailer| trailer.bytes() as usize);
    assert_eq!(file.len() > layers_at, decoded.table.layers().is_some());
    assert_eq!(decoded.table.iter().count(), decoded.table.len());
    if let Some(trailer) = decoded.trailer {
        let mut written = Vec::new();
        let layers = layer_section(&decoded.table);
        write_table(&decoded.table, &layers, trailer.clone(), &mut written)
            .expect("writes to memory succeed");
        assert_eq!(written[..layers_at], file[..layers_at]);
        let again = read(&written).expect("the written file is valid");
        assert_eq!(again.trailer, Some(trailer));
        assert_eq!(layer_section(&again.table), layers);
    }
    true
}

/// Returns the section of a table's layers.
fn layer_section(table: &Table) -> Vec<u8> {
    let mut writer = CompactWriter::new(CompactEffort::Fast).expect("there is memory");
    writer.layer_section(table).expect("there is memory")
}

/// Returns the end of the entries of a table.
pub fn entries_end(file: &[u8]) -> Option<usize> {
    let count = u64::from_le_bytes(file.get(8..16)?.try_into().ok()?);
    usize::try_from(count.checked_mul(18)?.checked_add(16)?).ok()
}

/// Corrects the checksums of a table, and the length of the parameters after its trailer.
fn seal_table(file: &mut [u8]) {
    let Some((entries, behind)) = entries_end(file).and_then(|end| file.split_at_mut_checked(end)) else {
        return;
    };
    let Some((trailer, parameters)) = behind.split_at_mut_checked(TRAILER_BYTES) else { return };
    trailer[44..48].copy_from_slice(&crc32fast::hash(entries).to_le_bytes());
    trailer[60..64].copy_from_slice(&(parameters.len() as u32).to_le_bytes());
    trailer[64..68].copy_from_slice(&crc32fast::hash(parameters).to_le_bytes());
    seal(trailer);
}

/// Sets the last four bytes to the CRC-32 of those before.
fn seal(bytes: &mut [u8]) {
    if let Some((content, crc)) = bytes.split_last_chunk_mut::<4>() {
        *crc = crc32fast::hash(content).to_le_bytes();
    }
}

/// `tile.vxt`: the writer reproduces its front part and its table.
pub fn compact_file(data: &[u8]) -> bool {
    let Some((&choice, file)) = data.split_first() else { return false };
    let mut file = file.to_vec();
    if choice & 1 == 1 {
        seal_compact_file(&mut file);
    }
    let voxels = grid().voxels_of_tile(TILES[usize::from(choice >> 1 & 3)]);
    let read = |bytes: &[u8]| read_compact_file(&mut &bytes[..], bytes.len() as u64, &voxels);
    let index = CompactFileIndex::read(&mut &file[..], file.len() as u64, &voxels);
    if let Ok(Some(index)) = &index {
        query_voxels(index, &file, &voxels, None);
    }
    let Ok(decoded) = read(&file) else { return false };
    if let Some(index) = index.expect("the whole file is valid") {
        assert_eq!(index.crc, crc32fast::hash(&file));
        query_voxels(&index, &file, &voxels, Some(&decoded.table));
    }
    let front = decoded.trailer.expect("the front part is valid");
    assert_eq!(
        read_compact_front(&mut &file[..], file.len() as u64).expect("the whole file is valid"),
        front
    );
    let mut written = Vec::new();
    let compact = compact_bytes(&decoded.table);
    let layers = layer_section(&decoded.table);
    write_compact_file(&compact, &layers, front.clone(), &mut written).expect("writes to memory succeed");
    let again = read(&written).expect("the written file is valid");
    assert!(again.table.iter().eq(decoded.table.iter()));
    assert_eq!(layer_section(&again.table), layers);
    let of_content = |front: Trailer| Trailer { table_crc: 0, octree_crc: 0, octree_bytes: 0, ..front };
    assert_eq!(again.trailer.map(of_content), Some(of_content(front)));
    true
}

/// Queries some voxels of a `tile.vxt`, each from one group. Compares them with the table, if given.
fn query_voxels(index: &CompactFileIndex, file: &[u8], voxels: &VoxelBox, table: Option<&Table>) {
    for step in 0..9 {
        let voxel =
            std::array::from_fn(|k| voxels.min[k] + (step * [1, 3, 2][k]) % (voxels.end[k] - voxels.min[k]));
        let code = VoxelKey::from_index(voxel).morton();
        let place = index.group_of(code);
        let group = place.map(|place| &file[place.start as usize..place.end as usize]);
        let found = group.map(|group| index.evidence(code, group));
        if let Some(table) = table {
            let found = found.and_then(|found| found.expect("the whole file is valid"));
            assert_eq!(found, table.get(code));
        }
    }
}

/// Corrects the checksums of a `tile.vxt`.
fn seal_compact_file(file: &mut [u8]) {
    let Some((front, behind)) = file.split_at_mut_checked(TRAILER_BYTES) else { return };
    let length = u32::from_le_bytes(std::array::from_fn(|k| front[60 + k]));
    let Some((parameters, body)) = behind.split_at_mut_checked(length as usize) else { return };
    seal_parts(body);
    front[44..48].copy_from_slice(&crc32fast::hash(body).to_le_bytes());
    front[64..68].copy_from_slice(&crc32fast::hash(parameters).to_le_bytes());
    seal(front);
}

/// Corrects the checksums of codebook and groups of a compact table of version 2.
fn seal_parts(table: &mut [u8]) {
    let number = |table: &[u8], at: usize| {
        let bytes = table.get(at..).and_then(|table| table.first_chunk());
        bytes.map_or(0, |bytes| u32::from_le_bytes(*bytes) as usize)
    };
    if number(table, 4) != 2 {
        return;
    }
    let groups = number(table, 24).min(table.len() / 16);
    let mut begin = 36 + 16 * groups;
    for part in 0..=groups {
        let [length, crc] = if part == 0 { [28, 32] } else { [28 + 16 * part, 32 + 16 * part] };
        let end = begin + number(table, length);
        if let Some(content) = table.get(begin..end) {
            let content = crc32fast::hash(content).to_le_bytes();
            table[crc..crc + 4].copy_from_slice(&content);
        }
        begin = end;
    }
}

/// Compact form of a table: writing it and reading it back gives the same table and the same bytes. The input may be
/// another encoding of the table.
pub fn compact(data: &[u8]) -> bool {
    let Some((&choice, bytes)) = data.split_first() else { return false };
    let mut bytes = bytes.to_vec();
    if choice & 1 == 1 {
        if let Some((parts, _)) = bytes.split_last_chunk_mut::<4>() {
            seal_parts(parts);
        }
        seal(&mut bytes);
    }
    let voxels = grid().voxels_of_tile(TILES[usize::from(choice >> 1 & 3)]);
    let read = |bytes: &[u8]| read_compact(&mut &bytes[..], bytes.len() as u64, &voxels);
    let Ok(table) = read(&bytes) else { return false };
    assert_eq!(table.iter().count(), table.len());
    assert!(table.iter().all(|(code, _)| voxels.contains(code.to_key().to_index_from(voxels.min))));
    let written = compact_bytes(&table);
    let again = read(&written).expect("the written file is valid");
    assert!(again.iter().eq(table.iter()));
    assert!(compact_bytes(&again) == written);
    true
}

/// Returns the compact form of a table.
pub fn compact_bytes(table: &Table) -> Vec<u8> {
    let mut bytes = Vec::new();
    write_compact(table, CompactEffort::Fast, &mut bytes).expect("writes to memory succeed");
    bytes
}

/// `metadata.json`: a round trip through its text gives the same metadata.
pub fn metadata(data: &[u8]) -> bool {
    let Some((&choice, text)) = data.split_first() else { return false };
    let Ok(text) = str::from_utf8(text) else { return false };
    let read =
        if choice & 1 == 1 { Metadata::from_text(&sealed_metadata(text)) } else { Metadata::from_text(text) };
    let Ok(metadata) = read else { return false };
    let text = metadata.to_text();
    let again = Metadata::from_text(&text).expect("the written file is valid");
    assert_eq!(again, metadata);
    assert_eq!(again.to_text(), text);
    true
}

fn sealed_metadata(text: &str) -> String {
    const KEY: &str = "\"crc32\": \"";
    let Some(key) = text.rfind(KEY) else { return text.to_owned() };
    let guarded = &text[..key + KEY.len()];
    format!("{guarded}{:08x}\"\n  }}\n}}\n", crc32fast::hash(guarded.as_bytes()))
}

/// `commits.log`: its valid part alone gives the same result.
pub fn commit_log(data: &[u8]) -> bool {
    let Some((&choice, file)) = data.split_first() else { return false };
    let mut file = file.to_vec();
    if choice & 1 == 1 {
        seal_commit_log(&mut file);
    }
    let read = |bytes: &[u8]| CommitLog::read(&mut &bytes[..], bytes.len() as u64);
    let Ok((log, commits)) = read(&file) else { return false };
    assert!(log.bytes() <= file.len() as u64);
    let (again, same) = read(&file[..log.bytes() as usize]).expect("the valid part can be read");
    assert_eq!(again, log);
    assert_eq!((same.flush_number, same.scan_number), (commits.flush_number, commits.scan_number));
    assert_eq!((same.tiles, same.last_changed), (commits.tiles, commits.last_changed));
    true
}

fn seal_commit_log(file: &mut [u8]) {
    const HEADER_BYTES: usize = 32;
    let Some((header, mut records)) = file.split_at_mut_checked(HEADER_BYTES) else { return };
    seal(header);
    while let Some((lengths, rest)) = records.split_first_chunk_mut::<8>() {
        let payload_bytes = u32::from_le_bytes([lengths[0], lengths[1], lengths[2], lengths[3]]);
        if payload_bytes == 0 {
            return;
        }
        lengths[4..].copy_from_slice(&(!payload_bytes).to_le_bytes());
        let Some((payload, rest)) = rest.split_at_mut_checked(payload_bytes as usize + 4) else { return };
        seal(payload);
        records = rest;
    }
}

/// PCD in any of its encodings.
pub fn pcd(data: &[u8]) -> bool {
    let Ok(SensorScan { points_in_sensor, intensities, world_from_sensor, .. }) = read_pcd(data) else {
        return false;
    };
    assert!(intensities.is_none_or(|intensities| intensities.len() == points_in_sensor.len()));
    assert_is_pose(&world_from_sensor);
    true
}

/// OctoMap's scan graph, read scan by scan.
pub fn graph(data: &[u8]) -> bool {
    const POINT_BYTES: usize = 28;
    let source = read_scan_graph(data, data.len() as u64, Path::new("fuzz.graph"));
    source.is_ok_and(|source| {
        let points = all_points(source);
        assert!(points.is_none_or(|points| points * POINT_BYTES <= data.len()));
        points.is_some()
    })
}

/// OctoMap's scan log, read scan by scan.
pub fn log(data: &[u8]) -> bool {
    let points = all_points(read_scan_log(data, Path::new("fuzz.log")));
    assert!(points.is_none_or(|points| points <= data.len()));
    points.is_some()
}

/// voxtile's scan stream, read scan by scan.
pub fn scan_stream(data: &[u8]) -> bool {
    const POINT_BYTES: usize = 12;
    read_scan_stream(data, Path::new("fuzz.scans"), false).is_ok_and(|source| {
        // Reads the label that identifies the stream, or finds that it has none.
        source.fingerprint().unwrap_or_default();
        let points = all_points(source);
        assert!(points.is_none_or(|points| points * POINT_BYTES <= data.len()));
        points.is_some()
    })
}

/// Returns the number of points in all scans; `None` if a scan could not be read.
fn all_points(mut source: impl ScanSource) -> Option<usize> {
    let len_hint = source.len_hint();
    let (mut scans, mut points) = (0, 0);
    while let Some(scan) = source.next_scan().ok()? {
        assert_is_pose(&scan.world_from_sensor);
        scans += 1;
        points += scan.points_in_sensor.len();
    }
    assert!(len_hint.is_none_or(|hint| hint == scans));
    Some(points)
}

/// Points as text.
pub fn points(data: &[u8]) -> bool {
    let Ok(Ok(points)) = read_points(data) else { return false };
    assert!(points.len() <= data.len());
    true
}

/// Packets, requests and layers of map sharing: a round trip through the encoder gives the same value.
pub fn share_packet(data: &[u8]) -> bool {
    let Some((&choice, packet)) = data.split_first() else { return false };
    let mut packet = packet.to_vec();
    if choice & 1 == 1 {
        packet.extend(crc32fast::hash(&packet).to_le_bytes());
    }
    let is_packet = Packet::decode(&packet).is_ok_and(|read| {
        let written = read.encode().expect("a decoded packet can be encoded");
        let again = Packet::decode(&written).expect("the written file is valid");
        // Lengths of a status may be NaN, which does not compare equal.
        assert_eq!(format!("{:?}", in_order(again)), format!("{:?}", in_order(read)));
        true
    });
    let is_request = Request::decode(&packet).is_ok_and(|read| {
        assert_eq!(Request::decode(&read.encode()).expect("the written file is valid"), read);
        true
    });
    is_packet || is_request || read_layer(&mut &packet[..], 1 << 20).is_ok()
}

/// The voxels of a packet are ordered by its cube, which need not be the smallest one.
fn in_order(mut packet: Packet) -> Packet {
    match &mut packet {
        Packet::Changes { updates, .. } => updates.sort_unstable(),
        Packet::Content { voxels, .. } => voxels.sort_unstable(),
        Packet::Digests { .. } | Packet::Status(_) => {}
    }
    packet
}

/// A sender and a receiver whose voxels, losses, delays, duplicates, restarts and forged packets are taken from the
/// input. Once the link is reliable, their sets must become equal.
pub fn share_life(data: &[u8]) -> bool {
    let grid = Grid::new(0.1, 0.8).expect("8 voxels along a tile");
    let mut config = SenderConfig::default();
    (config.ring_packets, config.max_packet_bytes, config.latency) = (4, 256, Duration::from_millis(100));
    let new_sender = |epoch| Sender::new(grid, epoch, config.clone()).expect("a valid configuration");
    let (mut epoch, mut now) = (1, Duration::ZERO);
    let mut sender = new_sender(epoch);
    let mut receiver = Receiver::new(ReceiverConfig::default());
    let (mut down, mut up) = (Vec::<Vec<u8>>::new(), Vec::<Vec<u8>>::new());
    let mut script = data.iter().copied();
    while let Some(verb) = script.next() {
        let mut byte = || script.next().unwrap_or(0);
        match verb % 10 {
            0..3 => {
                let voxel = [byte(), byte(), byte()].map(|k| i32::from(k as i8));
                sender.put(voxel, verb & 128 == 0);
            }
            3 => now += Duration::from_millis(u64::from(byte()) * 20),
            4 => down.extend(sender.poll(now).into_iter().map(|packet| packet.bytes)),
            5 => up.extend(receiver.poll(now)),
            6 if !down.is_empty() => {
                let packet = down.swap_remove(usize::from(byte()) % down.len());
                if verb & 128 == 0 {
                    down.push(packet.clone());
                }
                receiver.take(&packet, now).expect("the packet of a sender is valid");
            }
            7 if !up.is_empty() => {
                let ask = up.swap_remove(usize::from(byte()) % up.len());
                let answers = sender.answer(1, &ask, now).expect("the request of a receiver is valid");
                down.extend(answers.into_iter().map(|packet| packet.bytes));
            }
            8 if verb & 128 == 0 => drop((down.pop(), up.pop())),
            8 => {
                epoch += 1;
                sender = new_sender(epoch);
            }
            9 => {
                let length = usize::from(byte());
                let mut packet = vec![1, 1 + verb / 10 % 4];
                packet.extend((0..length).map(|_| byte()));
                packet.extend(crc32fast::hash(&packet).to_le_bytes());
                let _ = receiver.take(&packet, now);
                let _ = sender.answer(2, &packet, now);
            }
            _ => {}
        }
    }
    for _ in 0..1200 {
        now += Duration::from_millis(100);
        for packet in sender.poll(now) {
            receiver.take(&packet.bytes, now).expect("the packet of a sender is valid");
        }
        for ask in receiver.poll(now) {
            for packet in sender.answer(1, &ask, now).expect("the request of a receiver is valid") {
                receiver.take(&packet.bytes, now).expect("the packet of a sender is valid");
            }
        }
        let is_equal = receiver.is_converged() && receiver.equal_as_of() == Some(sender.last_packet());
        if sender.is_idle() && is_equal {
            break;
        }
    }
    let layer = receiver.layer().expect("packets of a sender were received");
    assert!(receiver.is_over_limit() || layer == &*sender.sent(), "{:?}", receiver.counts());
    !sender.sent().is_empty()
}

fn assert_is_pose(pose: &Pose) {
    assert!(pose.position_m().iter().all(|number| number.is_finite()), "{pose:?}");
    assert!((pose.isometry().rotation.norm() - 1.0).abs() < 1e-6, "{pose:?}");
}
