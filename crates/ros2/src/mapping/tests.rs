use super::*;
use crate::messages;
use crate::services::{Orders, orders};
use clap::Parser;
use testkit::faulty_disk::{Fault, FaultyDisk};
use voxtile::MapPath;
use voxtile::SensorModel;
use voxtile::query::Queries;
use voxtile_formats::RigidPose;

/// Sensor position; `FAR` is in another tile.
const NEAR: [f64; 3] = [0.05; 3];
const FAR: [f64; 3] = [500.05, 0.05, 0.05];

fn open(folder: &Path, options: &[&str]) -> (Mapping, Orders) {
    let map = folder.join("map");
    let own = ["voxtile-ros2", "-o", map.to_str().unwrap(), "--resolution", "0.1", "--flush-every", "1000"];
    let args = Args::parse_from(own.iter().chain(options));
    let (orders, placed) = orders();
    (Mapping::open(&args, Arc::new(Inbox::new(&args)), placed).unwrap(), orders)
}

/// Opens a map on a simulated disk.
fn open_on(disk: &FaultyDisk, folder: &Path, keeps_scans: bool) -> (Mapping, Orders) {
    let (mut mapping, orders) = open(folder, &[]);
    let config = mapping.mapper.config().clone().with_kept_scans(keeps_scans);
    mapping.mapper = OutOfCoreTileMapper::create(MapPath::on(disk.shared(), "/map"), config).unwrap();
    (mapping, orders)
}

fn cloud(points_m: Vec<[f64; 3]>) -> Cloud {
    let frame = "lidar".to_owned();
    let header = messages::Header { frame_id: frame.clone(), ..messages::Header::default() };
    let cdr = messages::PointCloud2::of_points(header, points_m).cdr();
    Cloud::new(0, 0, frame, cdr)
}

fn at(sensor_m: Point) -> CloudPoses {
    let map_from_sensor = RigidPose { position_m: sensor_m, ..RigidPose::IDENTITY };
    CloudPoses { map_from_sensor, base_from_sensor: None, motion: None }
}

impl Mapping {
    fn map(&mut self, sensor_m: Point) {
        self.insert(&cloud(vec![[2.0, 0.0, 0.0]]), &at(sensor_m)).unwrap();
    }

    /// Waits for the running flush and processes its result.
    fn end_flush(&mut self) {
        while self.mapper.is_flushing() {
            std::thread::sleep(Duration::from_millis(1));
        }
        self.flush_if_due().unwrap();
    }
}

#[test]
fn the_tile_size_follows_the_resolution() {
    let tile_m = |options: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        open(folder.path(), options).0.mapper.config().grid.tile_size_m()
    };
    assert_eq!(tile_m(&[]), 10.0);
    assert_eq!(tile_m(&["--resolution", "0.15"]), 10.05);
    assert_eq!(tile_m(&["--resolution", "0.15", "--tile-size", "3"]), 3.0);
}

#[test]
fn a_cloud_on_a_damaged_tile_is_counted_and_others_are_mapped() {
    let folder = tempfile::tempdir().unwrap();
    let (mut mapping, _) = open(folder.path(), &[]);
    mapping.map(NEAR);
    mapping.map(FAR);
    mapping.mapper.flush().unwrap();
    let tile = mapping.mapper.tile_folder(mapping.mapper.config().grid.tile_of(NEAR).unwrap());
    drop(mapping);
    for file in std::fs::read_dir(tile).unwrap() {
        let path = file.unwrap().path();
        let mut bytes = std::fs::read(&path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(path, bytes).unwrap();
    }
    let (mut mapping, _) = open(folder.path(), &[]);
    mapping.map(NEAR);
    mapping.map(FAR);
    mapping.map(NEAR);
    let (counters, _) = mapping.inbox.counters();
    assert_eq!((counters.mapped, counters.refused_damaged, counters.malformed), (1, 2, 0));
    assert!(mapping.mapper.occupancy_at([502.05, 0.05, 0.05]).unwrap().is_occupied());
    mapping.mapper.flush().unwrap();
    assert_eq!(mapping.mapper.flushed_scan_number(), 3);
}

#[test]
fn mapping_continues_after_a_failed_flush_and_the_next_flush_succeeds() {
    let (folder, disk) = (tempfile::tempdir().unwrap(), FaultyDisk::new(Fault::None));
    let (mut mapping, orders) = open_on(&disk, folder.path(), false);
    mapping.map(NEAR);
    disk.set_fault(Fault::IsFull(0));
    let request = std::thread::spawn(move || orders.place(Order::Save));
    let order = mapping.orders.recv().unwrap();
    let mut mapping = mapping.execute(order).unwrap();
    mapping.flush_if_due().unwrap();
    mapping.end_flush();
    let answer = request.join().unwrap().unwrap_err();
    assert!(answer.starts_with("the flush failed: "), "{answer}");
    mapping.sample_health();
    assert!(mapping.live.health().has_flush_failed);

    // A waiting path does not trigger a flush after each scan while the disk fails.
    mapping.path = Some((1, Vec::new()));
    mapping.map(FAR);
    mapping.flush_if_due().unwrap();
    let (counters, _) = mapping.inbox.counters();
    assert_eq!((counters.mapped, counters.failed_flushes), (2, 1));
    assert!(!mapping.mapper.is_flushing());
    disk.make_room();
    mapping.flush_every = Duration::ZERO;
    mapping.flush_if_due().unwrap();
    mapping.end_flush();
    assert_eq!((mapping.mapper.flushed_scan_number(), mapping.has_flush_failed), (2, false));
    assert_eq!(mapping.inbox.counters().0.failed_flushes, 1);
}

#[test]
fn a_map_that_cannot_be_flushed_is_not_changed_and_mapping_continues() {
    let (folder, disk) = (tempfile::tempdir().unwrap(), FaultyDisk::new(Fault::None));
    let (mut mapping, orders) = open_on(&disk, folder.path(), false);
    mapping.map(NEAR);
    disk.set_fault(Fault::IsFull(0));
    let request = std::thread::spawn(move || orders.place(Order::Reset));
    let order = mapping.orders.recv().unwrap();
    let mut mapping = mapping.execute(order).unwrap();
    assert!(request.join().unwrap().is_err());
    mapping.map(NEAR);
    assert_eq!((mapping.mapper.scan_number(), mapping.inbox.counters().0.failed_flushes), (2, 1));
    disk.make_room();
    mapping.mapper.flush().unwrap();
}

#[test]
fn a_cloud_refused_by_a_full_disk_is_counted_and_the_next_one_is_mapped() {
    let (folder, disk) = (tempfile::tempdir().unwrap(), FaultyDisk::new(Fault::None));
    let (mut mapping, _) = open_on(&disk, folder.path(), true);
    disk.set_fault(Fault::IsFull(0));
    mapping.map(NEAR);
    disk.make_room();
    mapping.map(NEAR);
    let (counters, _) = mapping.inbox.counters();
    assert_eq!((counters.refused_disk, counters.mapped, mapping.mapper.scan_number()), (1, 1, 1));
}

#[test]
fn a_map_at_its_memory_limit_does_not_count_clouds_as_malformed() {
    let folder = tempfile::tempdir().unwrap();
    let (mut mapping, _) = open(folder.path(), &["--tile-size", "0.2", "--memory", "20MiB"]);
    // Each ray crosses hundreds of these small tiles.
    let around = |k: u32| [60.0 * f64::from(k).cos(), 60.0 * f64::from(k).sin(), 0.1 * f64::from(k)];
    mapping.insert(&cloud((0..600).map(around).collect()), &at(NEAR)).unwrap();
    mapping.map(NEAR);
    let (counters, _) = mapping.inbox.counters();
    assert_eq!((counters.refused_memory, counters.malformed, counters.mapped), (1, 0, 1));
}

#[test]
fn a_node_that_fails_flushes_the_map() {
    let folder = tempfile::tempdir().unwrap();
    let (mut mapping, _) = open(folder.path(), &[]);
    mapping.map(NEAR);
    let stop = Stop::default();
    stop.set();
    mapping.mapper.stop_with(stop);
    mapping.inbox.put_mount("lidar");
    mapping.inbox.put_cloud(0, cloud(vec![[2.0, 0.0, 0.0]]).cdr);
    let error = mapping.run(&Stop::default()).unwrap_err();
    assert!(matches!(error.downcast_ref(), Some(Error::Stopped)), "{error:#}");
    assert_eq!(MapReader::open(folder.path().join("map"), 0).unwrap().scan_number(), 1);
}

#[test]
fn a_waiting_path_is_dropped_by_a_revert() {
    let folder = tempfile::tempdir().unwrap();
    let (mut mapping, orders) = open(folder.path(), &["--path", "/path"]);
    mapping.map(NEAR);
    mapping.mapper.snapshot(&"before".parse().unwrap()).unwrap();
    mapping.map(NEAR);
    mapping.map(NEAR);
    mapping.path = Some((3, Vec::new()));
    assert!(mapping.awaits_flush());
    let request = std::thread::spawn(move || orders.place(Order::Revert("before".parse().unwrap())));
    let order = mapping.orders.recv().unwrap();
    let mut mapping = mapping.execute(order).unwrap();
    request.join().unwrap().unwrap();
    mapping.map(NEAR);
    assert_eq!((mapping.mapper.scan_number(), mapping.awaits_flush()), (2, false));
}

#[test]
fn points_outside_of_the_limits_are_neither_hits_nor_free() {
    let folder = tempfile::tempdir().unwrap();
    let (mut mapping, _) = open(folder.path(), &["--point-cloud-min-z", "-0.5", "--point-cloud-max-x", "3"]);
    // Only the first point is inside.
    mapping.insert(&cloud(vec![[2.0, 0.0, 0.0], [0.0, 2.0, -1.0], [4.0, 0.5, 0.0]]), &at(NEAR)).unwrap();
    let counters = mapping.inbox.counters().0;
    assert_eq!((counters.mapped, counters.points), (1, 1));
    let known = |map: &Mapping, point_m| map.mapper.occupancy_at(point_m).unwrap();
    assert!(known(&mapping, [2.05, 0.05, 0.05]).is_occupied());
    for unknown in [[0.05, 2.05, -0.95], [0.05, 1.05, -0.45], [4.05, 0.55, 0.05], [2.55, 0.35, 0.05]] {
        assert!(known(&mapping, unknown).is_unknown(), "{unknown:?}");
    }
}

#[test]
fn a_new_map_starts_from_an_octomap_file() {
    use voxtile::octree::{Octree, write_bt};
    use voxtile::space::VoxelKey;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("hall.bt");
    let mut tree = Octree::new();
    tree.set(VoxelKey::from_index([100, 0, 0]).morton(), 3.5);
    tree.set(VoxelKey::from_index([-300, 7, 0]).morton(), -2.0);
    write_bt(&tree, 0.2, 0.0, &mut std::fs::File::create(&file).unwrap()).unwrap();
    let options = ["--octomap-path", file.to_str().unwrap(), "--hit", "0.9"];
    let (mut mapping, _) = open(folder.path(), &options);
    let state = |map: &Mapping, point_m| map.mapper.occupancy_at(point_m).unwrap();
    let is_read =
        |map: &Mapping| state(map, [20.1, 0.1, 0.1]).is_occupied() && state(map, [-59.9, 1.5, 0.1]).is_free();
    assert!(is_read(&mapping));
    // The resolution is that of the file, the sensor model that of the options.
    assert_eq!(mapping.mapper.config().grid.resolution_m(), 0.2);
    let SensorModel::LogOdds(model) = mapping.mapper.config().sensor_model else { panic!("another model") };
    assert!((model.hit - 9_f64.ln()).abs() < 1e-9);
    mapping.map(NEAR);
    mapping.mapper.flush().unwrap();
    drop(mapping);
    // An existing map is continued.
    std::fs::write(&file, "changed").unwrap();
    let (mapping, _) = open(folder.path(), &options);
    assert!(is_read(&mapping) && mapping.mapper.scan_number() == 1);
}

#[test]
fn a_wrong_octomap_file_creates_no_map() {
    let folder = tempfile::tempdir().unwrap();
    let (map, file) = (folder.path().join("map"), folder.path().join("hall.bt"));
    let error = |options: &[&str]| {
        let own = ["voxtile-ros2", "-o", map.to_str().unwrap(), "--octomap-path", file.to_str().unwrap()];
        let args = Args::parse_from(own.iter().chain(options));
        let (_, placed) = orders();
        Mapping::open(&args, Arc::new(Inbox::new(&args)), placed).err().map(|error| format!("{error:#}"))
    };
    assert!(error(&[]).unwrap().contains("hall.bt"));
    std::fs::write(&file, "# Octomap OcTree binary file\nid OcTree\nsize 9\nres 0.1\ndata\n").unwrap();
    assert!(error(&[]).unwrap().contains("hall.bt"));
    assert!(
        error(&["--keep-scans"]).unwrap().contains("--octomap-path cannot be combined with --keep-scans")
    );
    assert!(!map.exists());
}

fn coloured_cloud(stamp_ns: i64) -> Cloud {
    let header = messages::Header { frame_id: "lidar".to_owned(), ..messages::Header::default() };
    let points = [([2.0, 0.0, 0.0], [10, 20, 30]), ([2.01, 0.01, 0.0], [30, 40, 50])];
    Cloud { cdr: messages::PointCloud2::of_colours(header, points).cdr(), stamp_ns, ..cloud(Vec::new()) }
}

#[test]
fn colours_and_stamps_reach_the_layers_of_a_new_map_which_keeps_them() {
    use voxtile::MapQueries;
    let folder = tempfile::tempdir().unwrap();
    let layers_at = |mapping: &Mapping| mapping.mapper.layers_at([2.05, 0.05, 0.05]).unwrap();
    let (mut mapping, _) = open(folder.path(), &["--layers", "colour,time"]);
    mapping.insert(&coloured_cloud(7), &at(NEAR)).unwrap();
    let layers = layers_at(&mapping).unwrap();
    assert_eq!((layers.points, layers.mean_colour()), (2, Some([20, 30, 40])));
    assert_eq!(layers.time.map(|time| (time.first_ns, time.last_ns)), Some((7, 7)));
    mapping.mapper.flush().unwrap();
    drop(mapping);
    // Another request is ignored with a warning.
    for options in [&[][..], &["--layers", "shape"]] {
        let (mut mapping, _) = open(folder.path(), options);
        mapping.insert(&coloured_cloud(9), &at(NEAR)).unwrap();
        let layers = layers_at(&mapping).unwrap();
        assert_eq!((layers.points, layers.colour.points), (4, 4));
        assert_eq!(mapping.mapper.config().layers().to_string(), "colour, time");
    }
    let other = tempfile::tempdir().unwrap();
    let (mut mapping, _) = open(other.path(), &[]);
    mapping.insert(&coloured_cloud(7), &at(NEAR)).unwrap();
    assert_eq!(layers_at(&mapping), None);
}

#[test]
fn the_ground_is_free_up_to_its_points_and_obstacles_on_it_are_occupied() {
    let folder = tempfile::tempdir().unwrap();
    let options = ["--filter-ground-plane", "--point-cloud-max-z", "1.5"];
    let (mut mapping, _) = open(folder.path(), &options);
    // The sensor is 1 m above the base, which is 3 m above the origin of the map.
    let map_from_sensor = RigidPose { position_m: [0.05, 0.05, 4.05], ..RigidPose::IDENTITY };
    let base_from_sensor = Some(RigidPose { position_m: [0.0, 0.0, 1.0], ..RigidPose::IDENTITY });
    let mut points: Vec<[f64; 3]> = Vec::new();
    for k in 0..400 {
        points.push([1.0 + 0.1 * f64::from(k % 20), -1.0 + 0.1 * f64::from(k / 20), -1.0]);
    }
    // A box on the ground, and a point above the limit, which is in the base frame.
    points.extend([[2.0, 0.0, -0.7], [2.0, 0.0, 0.9]]);
    mapping.insert(&cloud(points), &CloudPoses { map_from_sensor, base_from_sensor, motion: None }).unwrap();
    assert_eq!(mapping.inbox.counters().0.points, 401);
    let state = |point_m| mapping.mapper.occupancy_at(point_m).unwrap();
    assert!(state([2.05, 0.05, 3.35]).is_occupied());
    let (mut occupied, mut free) = (0, 0);
    for k in 0..400 {
        let ground_m = [1.05 + 0.1 * f64::from(k % 20), -0.95 + 0.1 * f64::from(k / 20), 3.05];
        occupied += usize::from(state(ground_m).is_occupied());
        free += usize::from(state([ground_m[0], ground_m[1], 3.15]).is_free());
    }
    assert_eq!(occupied, 0);
    assert!(free > 200, "{free}");
}
