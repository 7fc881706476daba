use super::octree_statistics::OctreeLedger;
use super::octree_worker::OctreeWorker;
use super::shared_tree::SharedTree;
use crate::in_many_orders;
use crate::octree::Octree;
use crate::space::MortonCode;
use shuttle::sync::{Arc, Mutex};
use shuttle::thread;

/// Two threads push more than the queue holds: all jobs are done, those of each thread in order, before the drop of the
/// worker returns.
#[test]
fn all_jobs_are_done_in_order_before_the_worker_ends() {
    in_many_orders(|| {
        let done = Arc::new(Mutex::new(Vec::new()));
        let worker = OctreeWorker::start(4, Arc::new(OctreeLedger::default())).unwrap();
        let givers: Vec<_> = (0..2)
            .map(|giver| {
                let (queue, done) = (worker.queue().clone(), done.clone());
                thread::spawn(move || {
                    for (number, voxels) in [3, 1, 9, 2].into_iter().enumerate() {
                        let done = done.clone();
                        let job = Box::new(move || done.lock().unwrap().push((giver, number)));
                        assert!(queue.push(voxels, job).is_ok());
                    }
                })
            })
            .collect();
        givers.into_iter().for_each(|giver| giver.join().unwrap());
        let queue = worker.queue().clone();
        drop(worker);
        let done = done.lock().unwrap();
        for giver in 0..2 {
            let numbers: Vec<usize> =
                done.iter().filter(|(of, _)| *of == giver).map(|(_, number)| *number).collect();
            assert_eq!(numbers, [0, 1, 2, 3]);
        }
        let counts = queue.counts();
        assert_eq!((counts.batches_in, counts.batches_out), (8, 8));
        assert_eq!((counts.voxels_in, counts.voxels_out), (30, 30));
        assert!(queue.push(1, Box::new(|| ())).is_err(), "a closed queue refuses jobs");
    });
}

/// A queue is closed while a thread waits for space: the job is returned or done, and there is no deadlock.
#[test]
fn a_closed_queue_wakes_waiting_threads() {
    in_many_orders(|| {
        let done = Arc::new(Mutex::new(0));
        let worker = OctreeWorker::start(1, Arc::new(OctreeLedger::default())).unwrap();
        let giver = thread::spawn({
            let (queue, done) = (worker.queue().clone(), done.clone());
            move || {
                let jobs = (0..4).map(|_| {
                    let done = done.clone();
                    queue.push(1, Box::new(move || *done.lock().unwrap() += 1)).is_ok()
                });
                jobs.filter(|is_in| *is_in).count()
            }
        });
        drop(worker);
        let taken = giver.join().unwrap();
        assert_eq!(*done.lock().unwrap(), taken);
    });
}

const VOXEL: MortonCode = MortonCode(77);

/// Value of the voxel in the tree and in the updates in flight; none while the tree is being written.
fn value_of(tree: &SharedTree) -> Option<f32> {
    tree.try_read(|tree, in_flight| {
        let latest = in_flight.iter().flatten().rfind(|(code, _)| *code == VOXEL);
        latest.map(|(_, value)| *value).or_else(|| tree.get(VOXEL, 16)).unwrap_or(0.0)
    })
}

/// One thread maps, the worker writes, one thread syncs, one queries: no query sees an older value after a newer one.
#[test]
fn no_update_of_a_tree_is_lost_or_seen_out_of_order() {
    in_many_orders(|| {
        let tree = Arc::new(SharedTree::new(Octree::new()));
        let worker = OctreeWorker::start(2, Arc::new(OctreeLedger::default())).unwrap();
        let syncs = thread::spawn({
            let tree = tree.clone();
            move || (0..2).for_each(|_| assert!(tree.write_all().is_some()))
        });
        let asks = thread::spawn({
            let tree = tree.clone();
            move || {
                let mut before = 0.0;
                for value in (0..4).filter_map(|_| value_of(&tree)) {
                    assert!(value >= before, "{value} after {before}");
                    before = value;
                }
            }
        });
        for number in 1..=3_u8 {
            tree.send(vec![(VOXEL, f32::from(number)), (MortonCode(100 + u64::from(number)), 1.0)]);
            let job = {
                let tree = tree.clone();
                Box::new(move || assert!(tree.write_all().is_some()))
            };
            assert!(worker.queue().push(2, job).is_ok());
            // Own updates are visible at once, unless the tree is being written.
            assert!(value_of(&tree).is_none_or(|value| value == f32::from(number)));
        }
        syncs.join().unwrap();
        asks.join().unwrap();
        drop(worker);
        assert_eq!(value_of(&tree), Some(3.0));
        assert_eq!((tree.in_flight_bytes() > 0, tree.read(Octree::leaf_count)), (true, Some(4)));
    });
}

/// A copy of a tree has all earlier updates, and a replaced tree has none of them.
#[test]
fn a_copy_has_all_updates_and_a_replaced_tree_has_none() {
    in_many_orders(|| {
        let tree = Arc::new(SharedTree::new(Octree::new()));
        tree.send(vec![(VOXEL, 1.0)]);
        let writes = thread::spawn({
            let tree = tree.clone();
            move || assert!(tree.write_all().is_some())
        });
        let copy = (*tree).clone();
        assert!(copy.write_all().is_some());
        assert_eq!(value_of(&copy), Some(1.0));
        tree.replace(Octree::from_sorted([(VOXEL, 5.0)]));
        writes.join().unwrap();
        assert_eq!(value_of(&tree), Some(5.0));
    });
}
