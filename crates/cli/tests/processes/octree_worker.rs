use crate::survey::wait_until;
use std::fs;
use std::thread::sleep;
use std::time::Duration;
use voxtile::{InMemoryMapper, MapConfig, MapView, Mapper, VoxelCacheConfig, VoxelCacheMode};
use voxtile_simulation::Survey;

/// Returns the running time in nanoseconds of each thread of this process that writes octrees.
fn workers() -> Vec<u64> {
    let threads = fs::read_dir("/proc/self/task").unwrap().map(|thread| thread.unwrap().path());
    let run_ns = threads.filter_map(|thread| {
        // A thread may end between listing and reading.
        let name = fs::read_to_string(thread.join("comm")).ok()?;
        let times = fs::read_to_string(thread.join("schedstat")).ok()?;
        (name.trim() == "voxtile-octrees").then(|| times.split(' ').next().unwrap().parse().unwrap())
    });
    run_ns.collect()
}

#[test]
fn one_thread_writes_all_octrees_sleeps_when_idle_and_ends_with_its_mapper() {
    assert_eq!(workers(), [0; 0]);
    let mode = VoxelCacheMode::Parallel(VoxelCacheConfig::new(1, 64));
    let config = MapConfig::new(0.2, 3.2).unwrap().with_range(0.0, 30.0).with_voxel_cache(mode);
    let mut mapper = InMemoryMapper::new(config).unwrap();
    for scan in Survey::street(1).take(2) {
        mapper.insert_scan(&scan).unwrap();
    }
    assert!(mapper.tile_indices().len() > 500);
    mapper.sync_octrees();
    let is_done = |mapper: &InMemoryMapper| {
        let queue = mapper.statistics().octrees.queue;
        queue.batches_in == queue.batches_out
    };
    wait_until("all octrees are written", || is_done(&mapper));
    // On a busy machine this may take long. The running time of a spinning thread would grow without end.
    wait_until("the thread is idle", || {
        let before = workers();
        assert_eq!(before.len(), 1);
        sleep(Duration::from_millis(300));
        workers() == before
    });

    drop(mapper);
    // The system may list a joined thread for a moment.
    wait_until("the thread is gone", || workers().is_empty());
}
