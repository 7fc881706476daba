//! Pointer octrees whose trees are written by another thread, which is stopped at critical moments.

use super::shared_tree::SharedTree;
use crate::config::{MapConfig, OctreeConfig, VoxelCacheConfig, VoxelCacheMode};
use crate::scan::{PointBatch, TileUpdates};
use crate::space::{MortonCode, TileIndex, VoxelIndex};
use crate::tile::octree::TileOctree;
use crate::tile::{OctreeFactory, OctreeQueueCounts, Tile};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::Duration;

const TILE: TileIndex = TileIndex::new(0, 0, 0);

/// A factory whose tiles cache one voxel each, so that all others are sent to the worker.
fn factory(limit_voxels: u64) -> OctreeFactory {
    let cache = VoxelCacheConfig::new(1, 1);
    OctreeFactory::with_queue(OctreeConfig::Pointers(VoxelCacheMode::Parallel(cache)), limit_voxels)
}

fn empty_tile(octrees: &OctreeFactory) -> Tile {
    Tile::empty(&MapConfig::default().grid, octrees, TILE)
}

/// Blocks the worker until the sender is used or dropped; returns once it is blocked.
fn hold(octrees: &OctreeFactory) -> Sender<()> {
    let ((release, released), (begin, begun)): ((_, Receiver<()>), _) = (channel(), channel());
    let job = move || {
        begin.send(()).unwrap();
        released.recv().unwrap_or_default();
    };
    assert!(octrees.worker().queue().push(0, Box::new(job)).is_ok());
    begun.recv().unwrap();
    release
}

/// Waits until the worker has completed all jobs so far.
fn wait_for_worker(octrees: &OctreeFactory) {
    let is_done = |counts: OctreeQueueCounts| counts.batches_in == counts.batches_out;
    while !is_done(octrees.worker().queue().counts()) {
        thread::sleep(Duration::from_millis(1));
    }
}

/// Updates voxels along a diagonal, each by a miss or a hit.
fn update(tile: &mut Tile, voxels: impl Iterator<Item = i32>, is_hit: bool) {
    let config = MapConfig::default();
    let points: Vec<_> = voxels.map(|k| config.grid.center_m([k % 100, k / 7 % 100, k / 3 % 100])).collect();
    let is_occupied = vec![is_hit; points.len()];
    let batch = PointBatch { points: &points, intensities: None, is_occupied: &is_occupied };
    let updates = batch.updates(&config.grid, &config.sensor_model).unwrap();
    let updates: BTreeMap<TileIndex, TileUpdates> = updates.tiles.into_iter().collect();
    tile.apply(&config.sensor_model, &updates[&TILE]);
}

/// Compares the nodes of all depths with the table's voxels.
fn assert_answers(tile: &Tile) {
    for depth in 1..=16 {
        let mut maxima: BTreeMap<MortonCode, (VoxelIndex, f32)> = BTreeMap::new();
        for (code, evidence) in tile.table().iter() {
            let log_odds = evidence.log_odds as f32;
            let (_, max) = maxima.entry(code.ancestor(depth)).or_insert((tile.index_of(code), log_odds));
            *max = max.max(log_odds);
        }
        for (voxel, max) in maxima.into_values() {
            assert_eq!(tile.max_log_odds_under(voxel, depth), Some(max), "{voxel:?} at depth {depth}");
        }
        assert_eq!(tile.max_log_odds_under([99, 0, 99], 16), None);
    }
}

fn tree_of(tile: &Tile) -> Arc<SharedTree> {
    let TileOctree::Pointers(octree) = tile.tile_octree() else {
        unreachable!("the factory creates pointer octrees")
    };
    octree.shared_tree().clone()
}

fn batches_in_flight(tile: &Tile) -> usize {
    tree_of(tile).try_read(|_, in_flight| in_flight.len()).expect("no thread is writing the tree")
}

#[test]
fn queries_see_pending_batches_newest_first() {
    let octrees = factory(1 << 20);
    let mut tile = empty_tile(&octrees);
    let gate = hold(&octrees);
    for (is_hit, voxels) in [(true, 0..300), (false, 100..400), (false, 150..250), (true, 200..210)] {
        update(&mut tile, voxels, is_hit);
        assert!(!tile.is_octree_synced());
        assert_answers(&tile);
    }
    assert_eq!(
        (batches_in_flight(&tile), tree_of(&tile).node_count()),
        (4, 0),
        "the worker is blocked, so no batch is written"
    );
    drop(gate);
    wait_for_worker(&octrees);
    assert!(tree_of(&tile).node_count() > 0);
    assert_answers(&tile);
    // One voxel is still cached.
    assert!(!tile.is_octree_synced());
    tile.sync_octree();
    assert!(tile.is_octree_synced());
    assert_answers(&tile);
}

#[test]
fn queries_do_not_wait_for_a_tree_that_is_being_written() {
    let octrees = factory(1 << 20);
    let mut tile = empty_tile(&octrees);
    update(&mut tile, 0..200, true);
    wait_for_worker(&octrees);
    let tree = tree_of(&tile);
    tree.change(|_| {
        // This thread holds the tree's lock, so waiting for it would deadlock.
        update(&mut tile, 100..300, false);
        assert_answers(&tile);
        assert!(!tile.is_octree_synced());
        assert!(tile.bytes() > 0 && tile.counts().octree_nodes > 0);
    });
    wait_for_worker(&octrees);
    assert_answers(&tile);
}

#[test]
fn a_panic_during_a_write_loses_no_updates() {
    let octrees = factory(1 << 20);
    let mut tile = empty_tile(&octrees);
    update(&mut tile, 0..200, true);
    let tree = tree_of(&tile);
    let job = move || {
        tree.change(|_| panic!("a panic for this test"));
    };
    assert!(octrees.worker().queue().push(0, Box::new(job)).is_ok());
    wait_for_worker(&octrees);
    // The worker is still running, and all queries are answered.
    assert_answers(&tile);
    update(&mut tile, 100..300, false);
    wait_for_worker(&octrees);
    assert_answers(&tile);
    assert!(!tile.is_octree_synced());
    assert!(tree_of(&tile).in_flight_bytes() < 1000, "batches of a broken tree are not kept");
    assert_answers(&tile.clone());
    tile.sync_octree();
    assert!(tile.is_octree_synced());
    assert_answers(&tile);
    assert_eq!(tree_of(&tile).read(|tree| tree.node_count()), Some(tile.octree().node_count()));
}

#[test]
fn a_sync_writes_pending_batches_without_waiting() {
    let octrees = factory(1 << 20);
    let mut tile = empty_tile(&octrees);
    let gate = hold(&octrees);
    update(&mut tile, 0..300, true);
    tile.sync_octree();
    assert!(tile.is_octree_synced());
    assert_answers(&tile);
    drop(gate);
    wait_for_worker(&octrees);
    let statistics = octrees.statistics();
    assert_eq!(statistics.voxels_written, tile.table().len() as u64);
    assert_eq!(statistics.queue.voxels_in, statistics.queue.voxels_out);
}

#[test]
fn a_clone_has_its_own_tree_and_pending_batches() {
    let octrees = factory(1 << 20);
    let mut tile = empty_tile(&octrees);
    let gate = hold(&octrees);
    update(&mut tile, 0..300, true);
    let mut other = tile.clone();
    update(&mut tile, 100..300, false);
    update(&mut other, 0..100, false);
    drop(gate);
    wait_for_worker(&octrees);
    assert_answers(&tile);
    assert_answers(&other);
    other.sync_octree();
    assert_answers(&other);
    assert_answers(&tile);
}

#[test]
fn senders_wait_when_the_queue_is_full() {
    let octrees = factory(150);
    let gate = hold(&octrees);
    thread::scope(|scope| {
        let mapping: Vec<_> = (0..4)
            .map(|number| {
                let octrees = &octrees;
                scope.spawn(move || {
                    let mut tile = empty_tile(octrees);
                    for step in 0..20 {
                        update(&mut tile, 40 * number + step..40 * number + step + 60, step % 2 == 0);
                    }
                    tile.sync_octree();
                    assert_answers(&tile);
                })
            })
            .collect();
        // All four must wait: two batches fill the queue.
        while octrees.worker().queue().counts().waits < 4 {
            thread::sleep(Duration::from_millis(1));
        }
        let counts = octrees.worker().queue().counts();
        assert!(counts.voxels_in - counts.voxels_out <= 150 && counts.batches_out == 0, "{counts:?}");
        assert!(mapping.iter().all(|thread| !thread.is_finished()));
        drop(gate);
    });
    wait_for_worker(&octrees);
    let counts = octrees.worker().queue().counts();
    assert!(counts.peak_voxels <= 150 && counts.peak_voxels > 0, "{counts:?}");
    assert_eq!((counts.voxels_in, counts.batches_in), (counts.voxels_out, counts.batches_out));
}

#[test]
fn a_batch_above_the_limit_is_queued_alone() {
    let octrees = factory(10);
    let mut tile = empty_tile(&octrees);
    for step in 0..5 {
        update(&mut tile, 0..200, step % 2 == 0);
    }
    wait_for_worker(&octrees);
    assert_answers(&tile);
    let counts = octrees.worker().queue().counts();
    assert!(counts.peak_voxels > 10 && counts.peak_voxels < 200, "{counts:?}");
}

#[test]
fn pending_batches_are_dropped_with_their_tile() {
    let octrees = factory(1 << 20);
    let gate = hold(&octrees);
    let mut tile = empty_tile(&octrees);
    update(&mut tile, 0..300, true);
    let tree: Weak<SharedTree> = Arc::downgrade(&tree_of(&tile));
    drop(tile);
    assert!(tree.upgrade().is_none());
    drop(gate);
    wait_for_worker(&octrees);
    assert_eq!(octrees.statistics().voxels_written, 0);
}

#[test]
fn closing_a_full_queue_writes_its_batches_and_ends_the_thread() {
    let octrees = factory(100);
    let queue = Arc::downgrade(octrees.worker().queue());
    let gate = hold(&octrees);
    let mut tile = empty_tile(&octrees);
    update(&mut tile, 0..80, true);
    let mut late = empty_tile(&octrees);
    let waiting = thread::spawn(move || {
        update(&mut late, 0..90, true);
        late
    });
    while octrees.worker().queue().counts().waits == 0 {
        thread::sleep(Duration::from_millis(1));
    }
    let opening = thread::spawn(move || {
        thread::sleep(Duration::from_millis(20));
        drop(gate);
    });
    drop(octrees);
    opening.join().unwrap();
    // Threads that were waiting for space when the queue was closed write the trees themselves.
    let mut late = waiting.join().unwrap();
    for tile in [&mut tile, &mut late] {
        assert_eq!(batches_in_flight(tile), 0);
        assert_answers(tile);
        update(tile, 50..150, false);
        assert_answers(tile);
    }
    drop((tile, late));
    assert!(queue.upgrade().is_none(), "the worker's thread must have ended and dropped the queue");
}

#[test]
fn a_thousand_tiles_share_one_worker() {
    let octrees = factory(1000);
    let mut tiles: Vec<Tile> = (0..1000).map(|_| empty_tile(&octrees)).collect();
    for (number, tile) in (0..).zip(&mut tiles) {
        update(tile, number..number + 20, true);
    }
    wait_for_worker(&octrees);
    let counts = octrees.worker().queue().counts();
    assert!(counts.batches_out >= 1000 && counts.peak_voxels <= 1000);
    tiles.iter().step_by(50).for_each(assert_answers);
}
