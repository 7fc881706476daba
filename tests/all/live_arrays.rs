//! Concurrent queries: arrays of queries, and parallel loops of the caller over single queries, in up to eight threads
//! with small stacks, while the mapper inserts, evicts and flushes.
//!
//! Long run: `VOXTILE_READER_SECONDS=300 cargo test --release --test all -- live_arrays`.

use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};
use testkit::memory_folder::memory_folder;
use testkit::random_scans::Random;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::{
    Aabb, Error, Evidence, Hit, InMemoryMapper, LiveReader, MapConfig, MapPath, MapQueries, Mapper,
    Occupancy, OutOfCoreTileMapper, Point, Queries, RayQuery, Result, Scan, Shape, UnknownAs, Voxel,
};

const SCANS: usize = 12;

/// A query needs a few kilobytes of stack. If waiting queries started others on their stack, this would overflow.
const STACK_BYTES: usize = 256 << 10;

/// Far longer than a run takes, even on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

struct Setting {
    config: MapConfig,
    scans: Vec<Scan>,
    points: Vec<Point>,
    rays: Vec<RayQuery>,
    region: Aabb,
    /// Expected results after each number of scans.
    expected: Vec<Answers>,
}

#[derive(Debug, PartialEq)]
struct Answers {
    occupancies: Vec<Occupancy>,
    evidence: Vec<Option<Evidence>>,
    hits: Vec<Option<Hit>>,
    nearest: Vec<Option<Hit>>,
    collisions: Vec<Option<Hit>>,
    occupied: Vec<Voxel>,
    in_region: Vec<Voxel>,
}

impl Setting {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed);
        let config = MapConfig::new(0.1, 1.6).unwrap();
        let mut scan = || {
            let origin = random.point([0.0; 3], 3.0);
            Scan { origin, points: (0..300).map(|_| random.point(origin, 4.0)).collect(), intensities: None }
        };
        let scans: Vec<_> = (0..SCANS).map(|_| scan()).collect();
        let points: Vec<_> = (0..1500).map(|_| random.point([0.0; 3], 8.0)).collect();
        let mut ray = || RayQuery {
            origin: random.point([0.0; 3], 4.0),
            direction: random.point([0.0; 3], 1.0),
            max_range_m: Some(10.0),
            unknown: UnknownAs::Free,
        };
        let rays = (0..150).map(|_| ray()).collect();
        let region = Aabb { min: [-2.0; 3], max: [2.0, 2.0, 0.5] };
        let mut setting = Self { config, scans, points, rays, region, expected: Vec::new() };
        let mut map = InMemoryMapper::new(setting.config.clone()).unwrap();
        setting.expected.push(setting.ask(&map).unwrap());
        for scan in &setting.scans {
            map.insert_scan(scan).unwrap();
            setting.expected.push(setting.ask(&map).unwrap());
        }
        setting
    }

    /// Runs all queries on one state of the map.
    fn ask(&self, map: &(impl MapQueries + Queries)) -> Result<Answers> {
        let some = &self.points[..40];
        let nearest = |point: &Point| map.nearest_occupied(*point, 2.0);
        let body = |&center: &Point| Shape::Sphere { center, radius_m: 0.4 };
        let collision = |point: &Point| map.collision(&body(point), UnknownAs::Free);
        Ok(Answers {
            occupancies: map.occupancy_at_points(&self.points)?,
            evidence: map.evidence_at_points(&self.points)?,
            hits: map.cast_rays(&self.rays)?,
            nearest: some.par_iter().map(nearest).collect::<Result<_>>()?,
            collisions: some.par_iter().map(collision).collect::<Result<_>>()?,
            occupied: map.all_occupied_voxels(None)?,
            in_region: map.evidence_in(&self.region).collect::<Result<_>>()?,
        })
    }

    /// Runs all queries on a view; `false` if it has expired.
    fn ask_view(&self, reader: &LiveReader) -> bool {
        let view = reader.view();
        let number = voxtile::MapView::scan_number(&view);
        match self.ask(&view) {
            Ok(answers) => assert!(answers == self.expected[number as usize], "the view of scan {number}"),
            Err(Error::Expired) => return false,
            Err(error) => panic!("{error}"),
        }
        true
    }

    /// Queries the reader for arrays: each result is that of one scan.
    fn ask_reader(&self, reader: &LiveReader, inserted: &AtomicU64) {
        // The count is read before and after the queries, because a scan becomes visible before it is counted.
        let before = inserted.load(Ordering::SeqCst) as usize;
        let (hits, occupancies) = (reader.cast_rays(&self.rays), reader.occupancy_at_points(&self.points));
        let after = (inserted.load(Ordering::SeqCst) as usize + 1).min(SCANS);
        let (hits, occupancies) = (hits.unwrap(), occupancies.unwrap());
        let possible = &self.expected[before..=after];
        assert!(possible.iter().any(|answers| answers.hits == hits), "rays of scans {before} to {after}");
        assert!(
            possible.iter().any(|answers| answers.occupancies == occupancies),
            "points of scans {before} to {after}"
        );
    }

    /// Runs single queries in a parallel loop, each on the latest scan.
    fn ask_one_by_one(&self, reader: &LiveReader, inserted: &AtomicU64) {
        let before = inserted.load(Ordering::SeqCst) as usize;
        let found: Vec<_> = self.rays.par_iter().take(60).map(|ray| reader.cast_ray(ray).unwrap()).collect();
        let after = (inserted.load(Ordering::SeqCst) as usize + 1).min(SCANS);
        for (number, hit) in found.iter().enumerate() {
            let mut possible = self.expected[before..=after].iter();
            assert!(possible.any(|answers| answers.hits[number] == *hit), "ray {number}");
        }
    }
}

/// Threads of the queries and of the mapper.
#[derive(Clone, Copy, Debug)]
struct Threads {
    askers: usize,
    /// Number of threads of a pool with small stacks for queries; `None` for the global pool.
    pool: Option<usize>,
    /// Whether the mapper is called inside that pool.
    is_mapper_inside: bool,
}

fn life(setting: &Setting, threads: Threads) -> u64 {
    let pool: Option<ThreadPool> = threads
        .pool
        .map(|count| ThreadPoolBuilder::new().num_threads(count).stack_size(STACK_BYTES).build().unwrap());
    let in_pool = |work: &mut (dyn FnMut() + Send)| match &pool {
        Some(pool) => pool.install(work),
        None => work(),
    };
    let folder = memory_folder();
    let path = MapPath::on(UnsyncedDisk::shared(), folder.path().join("map"));
    // Memory for a part of the tiles, so that some are evicted and read by queries.
    let config = setting.config.clone();
    let config = match threads.askers % 2 {
        0 => config.with_cache_tiles(60),
        _ => config.with_tight_memory_bytes(16 << 20),
    };
    let mut mapper = OutOfCoreTileMapper::create(path, config).unwrap();
    let reader = mapper.reader().unwrap();
    let (is_over, inserted, answered) = (AtomicBool::new(false), AtomicU64::new(0), AtomicU64::new(0));
    thread::scope(|scope| {
        for number in 0..threads.askers {
            let (reader, is_over, inserted, answered) = (reader.clone(), &is_over, &inserted, &answered);
            let in_pool = &in_pool;
            let ask = move || {
                for round in number.. {
                    in_pool(&mut || match round % 3 {
                        0 => setting.ask_reader(&reader, inserted),
                        1 => setting.ask_one_by_one(&reader, inserted),
                        _ => drop(setting.ask_view(&reader)),
                    });
                    answered.fetch_add(1, Ordering::Relaxed);
                    if is_over.load(Ordering::Relaxed) {
                        break;
                    }
                }
            };
            thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, ask).unwrap();
        }
        let mut insert = |number: usize| {
            mapper.insert_scan(&setting.scans[number]).unwrap();
            inserted.fetch_add(1, Ordering::SeqCst);
            if number % 7 == 6 {
                mapper.flush().unwrap();
            } else if number % 7 == 3 {
                mapper.begin_flush().unwrap();
            }
        };
        for number in 0..SCANS {
            match (&pool, threads.is_mapper_inside) {
                (Some(pool), true) => pool.install(|| insert(number)),
                (None, true) => rayon::scope(|_| insert(number)),
                (_, false) => insert(number),
            }
        }
        is_over.store(true, Ordering::Relaxed);
    });
    answered.into_inner()
}

#[test]
fn array_queries_in_many_threads_with_small_stacks_during_inserts() {
    let seconds = std::env::var("VOXTILE_READER_SECONDS").ok().and_then(|text| text.parse().ok());
    let until = Instant::now() + Duration::from_secs(seconds.unwrap_or(1));
    let (done, is_done) = channel::<()>();
    let lives = move || {
        let (mut lives, mut answered) = (0, 0);
        for seed in 0.. {
            let setting = Setting::new(seed);
            let threads = [
                (8, None, false),
                (4, None, true),
                (3, Some(1), true),
                (1, Some(3), false),
                (6, Some(3), true),
            ];
            for (askers, pool, is_mapper_inside) in threads {
                answered += life(&setting, Threads { askers, pool, is_mapper_inside });
                lives += 1;
            }
            if Instant::now() >= until {
                break;
            }
        }
        println!("{answered} rounds of queries in {lives} lives");
        drop(done);
    };
    let lives = thread::spawn(lives);
    // Nothing is sent: the channel closes when the runs end, with or without a failure.
    let longest = PATIENCE + Duration::from_secs(seconds.unwrap_or(1));
    let ended = is_done.recv_timeout(longest);
    assert!(ended != Err(RecvTimeoutError::Timeout), "queries and the mapper wait for each other");
    lives.join().unwrap();
}
