use proptest::prelude::*;
use std::collections::BTreeMap;
use voxtile::space::{Grid, LAST_VOXEL_INDEX, TileIndex};
use voxtile_share::codec::{
    CONTEXTS, DigestEntry, Header, MAX_VOXELS_PER_PACKET, Packet, Request, Status, Update, VERSION,
    count_contexts, decode_updates, encode_updates,
};
use voxtile_share::{SetPosition, SetRange, VoxelSet, read_layer, write_layer};

/// Generates scattered or dense voxels around any origin.
fn updates() -> impl Strategy<Value = Vec<Update>> {
    let origin = prop_oneof![Just([0; 3]), Just([-70_000, 3, 2_000_000_000]), any::<[i32; 3]>()]
        .prop_map(|origin: [i32; 3]| origin.map(|k| k.clamp(i32::MIN, i32::MAX - (1 << 21))));
    let spread = prop_oneof![Just(4), Just(60), Just(3000)];
    (origin, spread).prop_flat_map(|(origin, spread)| {
        let voxel = prop::array::uniform3(0..spread)
            .prop_map(move |local: [i32; 3]| std::array::from_fn(|k| origin[k] + local[k]));
        prop::collection::btree_map(voxel, any::<bool>(), 0..300)
            .prop_map(|voxels| voxels.into_iter().map(|(voxel, is_in)| Update { voxel, is_in }).collect())
    })
}

fn sorted(updates: &[Update]) -> BTreeMap<[i32; 3], bool> {
    updates.iter().map(|update| (update.voxel, update.is_in)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn updates_survive_encoding(updates in updates(), direction in 0..3) {
        let is_in = |update: &Update| match direction { 0 => true, 1 => false, _ => update.is_in };
        let updates: Vec<Update> = updates.iter().map(|u| Update { is_in: is_in(u), ..*u }).collect();
        let bytes = encode_updates(&updates).unwrap();
        let read = decode_updates(&bytes, 0).unwrap();
        prop_assert_eq!(read.len(), updates.len());
        prop_assert_eq!(sorted(&read), sorted(&updates));
    }

    #[test]
    fn any_bytes_are_decoded_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        if let Ok(updates) = decode_updates(&bytes, 0) {
            prop_assert!(updates.len() <= MAX_VOXELS_PER_PACKET);
            // Decoded updates can be encoded and decoded again.
            let again = decode_updates(&encode_updates(&updates).unwrap(), 0).unwrap();
            prop_assert_eq!(sorted(&again), sorted(&updates));
        }
    }

    #[test]
    fn a_damaged_packet_is_refused(updates in updates(), at in any::<prop::sample::Index>(), flip in 1..=255_u8) {
        let header = Header { epoch: 7, sequence: 300 };
        let mut bytes = Packet::Changes { header, repaired: vec![2, 299], updates }.encode().unwrap();
        let at = at.index(bytes.len());
        bytes[at] ^= flip;
        prop_assert!(Packet::decode(&bytes).is_err());
        prop_assert!(Request::decode(&bytes).is_err());
    }
}

fn position(x: i32, y: i32, z: i32, code: u64) -> SetPosition {
    SetPosition { tile: TileIndex::new(x, y, z), code }
}

#[test]
fn packets_and_requests_survive_encoding() {
    let header = Header { epoch: u32::MAX, sequence: u64::MAX };
    let range =
        SetRange { first: position(-5, 0, 7, 1 << 40), last: position(i32::MAX, -3, 2, (1 << 48) - 1) };
    let entry = |z, voxels| DigestEntry { last: TileIndex::new(0, 0, z), voxels, digest: [9; 8] };
    let entries = vec![entry(4, 0), entry(5, u64::MAX), entry(i32::MAX, 3)];
    let (resolution_m, tile_size_m) = (0.1, 10.0);
    let status =
        Status { header, nonce: 5, oldest: 3, resolution_m, tile_size_m, voxels: 9, digest: [3; 32] };
    let voxels = vec![[1, 2, 3], [1, 2, 4]];
    let packets = [
        Packet::Changes {
            header,
            repaired: vec![0, u64::MAX],
            updates: vec![Update { voxel: [-8, 0, 7], is_in: false }],
        },
        Packet::Content { header, range: SetRange::ALL, voxels: Vec::new() },
        Packet::Content { header, range, voxels },
        Packet::Digests { header, first: TileIndex::new(i32::MIN, 0, 0), entries },
        Packet::Status(status),
    ];
    for packet in packets {
        assert_eq!(Packet::decode(&packet.encode().unwrap()).unwrap(), packet);
    }
    let requests = [
        Request::Status { nonce: 77 },
        Request::Missing { epoch: 3, sequences: vec![1, 2, 500, u64::MAX] },
        Request::Digests { epoch: 3, range: SetRange::ALL },
        Request::Content { epoch: 3, ranges: vec![range, SetRange::ALL] },
    ];
    for request in requests {
        assert_eq!(Request::decode(&request.encode()).unwrap(), request);
    }
}

#[test]
fn another_version_is_refused_and_named() {
    let mut bytes = Request::Status { nonce: 1 }.encode();
    bytes[0] = VERSION + 1;
    let error = Packet::decode(&bytes).unwrap_err().to_string();
    assert!(error.contains(&format!("version {}", VERSION + 1)), "{error}");
}

#[test]
fn too_many_voxels_are_refused_on_both_sides() {
    let cube = |edge: i32| {
        let voxel = move |n: i32| [n % edge, n / edge % edge, n / edge / edge];
        (0..edge * edge * edge).map(move |n| Update { voxel: voxel(n), is_in: true }).collect::<Vec<_>>()
    };
    let bytes = encode_updates(&cube(25)).unwrap();
    assert_eq!(decode_updates(&bytes, 0).unwrap().len(), 25 * 25 * 25);
    assert!(bytes.len() < 200, "{} bytes for a solid cube", bytes.len());
    assert!(encode_updates(&cube(26)).is_err());
    // A full cube with an edge of 2^20 voxels: the decoder stops early.
    let hostile = [[1 << 5 | 20, 0, 0, 0].as_slice(), &[0; 1000]].concat();
    let error = decode_updates(&hostile, 0).unwrap_err().to_string();
    assert!(error.contains("more than"), "{error}");
}

#[test]
fn voxels_too_far_apart_are_refused() {
    let far = [[0, 0, 0], [1 << 21, 0, 0]].map(|voxel| Update { voxel, is_in: true });
    assert!(encode_updates(&far).is_err());
    let end = [Update { voxel: [i32::MAX; 3], is_in: true }];
    assert!(encode_updates(&end).is_err());
}

/// Checks voxels up to the ends of the index range.
#[test]
fn every_decoded_voxel_can_be_encoded() {
    let last = LAST_VOXEL_INDEX;
    for voxel in [[last; 3], [2_147_483_632, 0, 0], [last - (1 << 20), 0, i32::MIN], [i32::MIN; 3]] {
        let updates = [Update { voxel, is_in: true }];
        assert_eq!(decode_updates(&encode_updates(&updates).unwrap(), 0).unwrap(), updates);
        let mut set = VoxelSet::new(Grid::new(0.1, 10.0).unwrap());
        assert!(set.put(voxel, true));
        let mut file = Vec::new();
        write_layer(&mut set, &mut file).unwrap();
        assert!(read_layer(&mut &file[..], 10).unwrap() == set);
        // The center of the voxel has the same index, so the voxel can become part of a map.
        assert_eq!(set.grid().voxel_of(set.grid().center_m(voxel)), Some(voxel));
    }
    // All voxels of the last brick, of which those with index 2^31 - 1 are invalid.
    let brick = [1 << 5 | 3, 254, 255, 255, 255, 1, 0, 0];
    for bits in [[0; 8], [255; 8]] {
        let Ok(updates) = decode_updates(&[&brick[..], &bits].concat(), 0) else { continue };
        assert!(encode_updates(&updates).is_ok(), "{updates:?}");
    }
    assert!(!VoxelSet::new(Grid::new(0.1, 10.0).unwrap()).put([i32::MAX, 0, 0], true));
}

#[test]
fn two_planes_take_less_than_a_bit_per_voxel() {
    // A floor with a wall.
    let floor = (0..40).flat_map(|x| (0..40).map(move |y| [x, y, 100]));
    let wall = (0..40).flat_map(|x| (101..125).map(move |z| [x, 39, z]));
    let updates: Vec<Update> = floor.chain(wall).map(|voxel| Update { voxel, is_in: true }).collect();
    let bytes = encode_updates(&updates).unwrap().len();
    assert!(bytes * 8 < updates.len(), "{bytes} bytes for {} voxels of two planes", updates.len());
}

#[test]
fn one_context_is_counted_per_bit() {
    let mut counts = vec![[0; 2]; CONTEXTS];
    count_contexts(&[Update { voxel: [8, 8, 8], is_in: true }], &mut counts).unwrap();
    assert_eq!(counts.iter().flatten().sum::<u64>(), 0, "one voxel at a corner of its brick needs no bit");
    count_contexts(&[[0; 3], [1, 0, 0]].map(|voxel| Update { voxel, is_in: true }), &mut counts).unwrap();
    assert_eq!(counts.iter().flatten().sum::<u64>(), 8);
}
