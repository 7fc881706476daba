use std::path::Path;
use tempfile::TempDir;
use testkit::random_scans::Random;
use testkit::unsynced_disk::UnsyncedDisk;
use voxtile::nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use voxtile::scan::{PointAttributes, ScanReport, TakePoints};
use voxtile::sensor::{Iwlo, SensorModel};
use voxtile::space::{Point, VoxelIndex};
use voxtile::{
    Error, InMemoryMapper, InsertMode, MapConfig, MapPath, MapQueries, Mapper, OutOfCoreTileMapper, Pose,
    Scan, ScanPoints, ScanRef,
};
use voxtile_formats::{PointBudget, ScanSource, ScanStreamWriter, SensorScan, StoredScan, read_scan_stream};
use voxtile_local::{LocalMap, LocalParameters, WithLocalMap};

/// Data of a sensor driver: `f32` points in the sensor's frame, intensities, and a separate pose.
struct Measured {
    points: Vec<[f32; 3]>,
    intensities: Option<Vec<f32>>,
    world_from_sensor: Isometry3<f64>,
}

fn measured(random: &mut Random, count: usize, has_intensities: bool) -> Measured {
    let points = (0..count).map(|_| {
        let [x, y, z] = random.point([0.0; 3], 5.0).map(|x| x as f32);
        match random.below(24) {
            0 => [0.0; 3],
            1 => [-0.0, 0.0, -0.0],
            2 => [f32::NAN, y, z],
            3 => [x, f32::INFINITY, z],
            4 => [f32::MAX, y, z],
            5 => [x, 0.0, 0.0],
            6 => [x, f32::MIN_POSITIVE, z],
            _ => [x, y, z],
        }
    });
    let points: Vec<[f32; 3]> = points.collect();
    let quaternion = Quaternion::from(std::array::from_fn::<f64, 4, _>(|_| random.between(-1.0, 1.0)));
    let position = random.point([700_000.3, -5_000.1, 12.7], 2.0);
    let intensity = |random: &mut Random| match random.below(20) {
        0 => f32::NAN,
        _ => random.between(0.0, 300.0) as f32,
    };
    Measured {
        intensities: has_intensities.then(|| (0..count).map(|_| intensity(random)).collect()),
        points,
        world_from_sensor: Isometry3::from_parts(
            Translation3::from(position),
            UnitQuaternion::new_normalize(quaternion),
        ),
    }
}

impl Measured {
    fn widened(&self) -> Vec<Point> {
        self.points.iter().map(|point| point.map(f64::from)).collect()
    }

    /// Transforms the points to the world frame by plain scalar arithmetic.
    fn in_world(&self) -> Scan {
        let rotation = self.world_from_sensor.rotation.to_rotation_matrix();
        let at = self.world_from_sensor.translation;
        let place = |p: &Point| {
            let row = |i: usize, t: f64| {
                ((rotation[(i, 0)] * p[0] + rotation[(i, 1)] * p[1]) + rotation[(i, 2)] * p[2]) + t
            };
            [row(0, at.x), row(1, at.y), row(2, at.z)]
        };
        let points = self.widened().iter().map(place).collect();
        Scan { origin: [at.x, at.y, at.z], points, intensities: self.intensities.clone() }
    }

    /// The same scan, read from a file.
    fn stored(&self) -> StoredScan {
        let (name, world_from_sensor) = (String::new(), self.world_from_sensor.into());
        let (points_in_sensor, intensities) = (self.widened(), self.intensities.clone());
        let attributes = PointAttributes::default();
        let scan = SensorScan { name, points_in_sensor, intensities, attributes, world_from_sensor };
        let mut bytes = Vec::new();
        let mut writer = ScanStreamWriter::new(&mut bytes, "", self.intensities.is_some()).unwrap();
        writer.write(&scan).unwrap();
        let mut source = read_scan_stream(&*bytes, Path::new("scans"), false).unwrap();
        let stored = source.next_stored(&PointBudget::default()).unwrap().unwrap();
        // The stream normalizes the quaternion again, which may change its last bits. Use the original pose.
        StoredScan { world_from_sensor, ..stored }
    }
}

/// Number of forms in which a scan can be passed.
const FORMS: usize = 6;

/// Passes a measurement to `take` in one of the forms.
fn with_form<T>(measured: &Measured, form: usize, take: impl FnOnce(&dyn ScanPoints) -> T) -> T {
    let (pose, widened, in_world) = (measured.world_from_sensor, measured.widened(), measured.in_world());
    let scan = match form {
        0 => return take(&in_world),
        1 => return take(&Scan::from_sensor_frame(&widened, measured.intensities.clone(), pose)),
        2 => return take(&measured.stored()),
        3 => ScanRef::in_sensor(pose, &measured.points),
        4 => ScanRef::in_sensor(Pose::from(pose), &widened),
        _ => ScanRef::in_world(in_world.origin, &in_world.points),
    };
    match &measured.intensities {
        Some(intensities) => take(&scan.with_intensities(intensities).unwrap()),
        None => take(&scan),
    }
}

/// A mapper of any kind, with a comparable digest.
trait AnyMapper: Mapper {
    fn digest_text(&self) -> String;
}

impl<M: Mapper> AnyMapper for M {
    fn digest_text(&self) -> String {
        self.digest().unwrap().to_string()
    }
}

/// Returns the mappers to test: one in memory, and two out of core, one with a small cache and write buffer, and one
/// with a tight memory limit.
fn mappers(config: &MapConfig, folder: &TempDir) -> Vec<Box<dyn AnyMapper>> {
    let mut mappers: Vec<Box<dyn AnyMapper>> = vec![Box::new(InMemoryMapper::new(config.clone()).unwrap())];
    let little = [
        config.clone().with_cache_tiles(4).with_write_buffer_bytes(5_000),
        config.clone().with_tight_memory_bytes(100_000),
    ];
    for config in little {
        let path = folder.path().join(mappers.len().to_string());
        let mapper = OutOfCoreTileMapper::create(MapPath::on(UnsyncedDisk::shared(), &path), config).unwrap();
        mappers.push(Box::new(mapper));
    }
    mappers
}

fn configs() -> impl Iterator<Item = (MapConfig, bool)> {
    let modes = [InsertMode::PerScan, InsertMode::PerRay];
    let models = [
        (SensorModel::default(), false),
        (SensorModel::default(), true),
        (SensorModel::Iwlo(Iwlo::default()), true),
    ];
    let config = MapConfig::new(0.2, 6.4).unwrap().with_range(0.3, 6.0);
    modes.into_iter().flat_map(move |mode| {
        let config = config.clone().with_insert_mode(mode);
        models.map(|(model, has_intensities)| (config.clone().with_sensor_model(model), has_intensities))
    })
}

/// Inserts the scans, passed in one form, into all mappers. Checks that their digests and reports are equal, and
/// returns them.
fn mapped(config: &MapConfig, scans: &[Measured], form: usize) -> (String, Vec<ScanReport>) {
    let folder = TempDir::new().unwrap();
    let mut outcomes = mappers(config, &folder).into_iter().map(|mut mapper| {
        let insert = |scan| with_form(scan, form, |scan| mapper.insert_points(scan).unwrap());
        let reports: Vec<ScanReport> = scans.iter().map(insert).collect();
        assert_eq!(mapper.scan_number(), scans.len() as u64);
        (mapper.digest_text(), reports)
    });
    let first = outcomes.next().unwrap();
    outcomes.for_each(|other| assert_eq!(other, first, "form {form}"));
    first
}

#[test]
fn every_form_of_a_scan_makes_an_identical_map() {
    for (seed, (config, has_intensities)) in configs().enumerate() {
        let random = &mut Random(100 + seed as u64);
        // Scans with few points, with none, and with enough for several threads.
        let scans = [80, 0, 1, 300, 9_000].map(|count| measured(random, count, has_intensities));
        let naive = mapped(&config, &scans, 0);
        let ScanReport { skipped, cut_at_max_range, .. } = *naive.1.last().unwrap();
        assert!(skipped.no_return > 500 && skipped.not_finite > 500 && cut_at_max_range > 500);
        for form in 1..FORMS {
            assert_eq!(mapped(&config, &scans, form), naive, "form {form}");
        }
    }
}

#[test]
fn points_of_the_world_frame_are_widened_exactly() {
    let random = &mut Random(7);
    for (config, has_intensities) in configs() {
        let mut by_scan = InMemoryMapper::new(config.clone()).unwrap();
        let mut by_ref = InMemoryMapper::new(config).unwrap();
        for _ in 0..3 {
            let Measured { points, intensities, .. } = measured(random, 200, has_intensities);
            let (origin, points_f64) = ([0.1, 0.2, 0.3], points.iter().map(|p| p.map(f64::from)).collect());
            let scan = ScanRef::in_world(origin, &points);
            let scan = match &intensities {
                Some(intensities) => scan.with_intensities(intensities).unwrap(),
                None => scan,
            };
            let report = by_ref.insert_points(&scan).unwrap();
            let scan = Scan { origin, points: points_f64, intensities };
            assert_eq!(by_scan.insert_scan(&scan).unwrap(), report);
        }
        assert_eq!(by_ref.digest().unwrap(), by_scan.digest().unwrap());
    }
}

/// Content of a local map.
fn content(map: &LocalMap) -> (Vec<(VoxelIndex, f64)>, usize, u64) {
    (map.history().collect(), map.voxels(), map.view().update_number())
}

#[test]
fn a_local_map_takes_every_form_with_and_without_an_archive() {
    let scans: Vec<Measured> = (0..4).map(|seed| measured(&mut Random(seed), 150, false)).collect();
    let config = MapConfig::new(0.2, 3.2).unwrap();
    let mut outcomes = (0..FORMS).map(|form| {
        let local = || LocalMap::new(0.2, LocalParameters::local_mapping()).unwrap();
        let mut alone = local();
        let mut both = WithLocalMap::new(InMemoryMapper::new(config.clone()).unwrap(), local()).unwrap();
        for scan in &scans {
            with_form(scan, form, |scan| {
                let report = alone.insert_points(scan).unwrap();
                assert_eq!(both.insert_points(scan).unwrap().1.updated, report.updated);
            });
        }
        assert_eq!(content(both.local()), content(&alone));
        (content(&alone), both.archive().digest().unwrap())
    });
    let first = outcomes.next().unwrap();
    assert!(first.0.0.len() > 200);
    outcomes.for_each(|other| assert!(other == first));
}

/// Points of a file that is damaged in the middle.
struct HalfRead;

impl ScanPoints for HalfRead {
    fn origin(&self) -> Point {
        [0.1; 3]
    }

    fn len(&self) -> usize {
        2
    }

    fn has_intensities(&self) -> bool {
        false
    }

    fn for_each_chunk(&self, _: std::ops::Range<usize>, take: &mut TakePoints<'_>) -> voxtile::Result<()> {
        take(&[[1.0; 3]], None);
        Err(Error::argument("points", "the rest cannot be read"))
    }
}

#[test]
fn a_failed_insert_changes_nothing() {
    let points = [[1.0, 0.0, 0.5], [2.0, 0.0, 0.5]];
    let scan = ScanRef::in_world([0.1; 3], &points);
    for wrong in [&[][..], &[1.0], &[1.0; 3]] {
        let error = scan.with_intensities(wrong).unwrap_err();
        assert!(matches!(&error, Error::InvalidArgument { argument, .. } if argument == "intensities"));
        assert!(error.to_string().contains("for 2 points"), "{error}");
    }
    let no_voxel = ScanRef::in_world([0.1, 1e300, 0.1], &points);
    let mut pose = Isometry3::identity();
    pose.rotation = UnitQuaternion::new_unchecked(Quaternion::new(f64::NAN, 0.0, 0.0, 0.0));
    let turned_nowhere = ScanRef::in_sensor(pose, &points);
    pose.translation.x = f64::NAN;
    let nowhere = ScanRef::in_sensor(pose, &points);
    let uneven = |intensities| Scan { origin: [0.1; 3], points: points.into(), intensities };
    let (few, many) = (uneven(Some(vec![1.0])), uneven(Some(vec![1.0; 3])));
    let of_none = Scan { points: Vec::new(), ..few.clone() };
    let wrong: [&dyn ScanPoints; 6] = [&no_voxel, &nowhere, &few, &many, &of_none, &HalfRead];

    for (config, _) in configs() {
        let needs_intensity = config.sensor_model.needs_intensity();
        let folder = TempDir::new().unwrap();
        for mut mapper in mappers(&config, &folder) {
            let good = scan.with_intensities(&[3.0, 4.0]).unwrap();
            mapper.insert_points(&good).unwrap();
            let before = mapper.digest_text();
            for scan in wrong {
                mapper.insert_points(scan).unwrap_err();
            }
            assert_eq!(mapper.insert_points(&scan).is_err(), needs_intensity);
            assert_eq!(mapper.digest_text() == before, needs_intensity);
            assert_eq!(mapper.scan_number(), if needs_intensity { 1 } else { 2 });
        }
    }

    let archive = InMemoryMapper::new(MapConfig::new(0.1, 6.4).unwrap()).unwrap();
    let local = LocalMap::new(0.1, LocalParameters::default()).unwrap();
    let mut both = WithLocalMap::new(archive, local).unwrap();
    both.insert_points(&scan).unwrap();
    let before = (content(both.local()), both.archive().digest().unwrap());
    for scan in wrong {
        both.insert_points(scan).unwrap_err();
    }
    assert!((content(both.local()), both.archive().digest().unwrap()) == before);
    // The pose is not finite, so both points are counted as not finite.
    assert_eq!(both.insert_points(&turned_nowhere).unwrap().0.skipped.not_finite, 2);
}

#[test]
fn invalid_poses_are_errors_with_a_reason() {
    let quaternion = |position_m, xyzw| Pose::from_quaternion(position_m, xyzw);
    let level = |last: [f64; 4]| {
        Pose::from_matrix(&[[1.0, 0.0, 0.0, 4.0], [0.0, 1.0, 0.0, 5.0], [0.0, 0.0, 1.0, 6.0], last])
    };
    let scaled = |by: f64| {
        Pose::from_matrix(&[[by, 0.0, 0.0, 4.0], [0.0, by, 0.0, 5.0], [0.0, 0.0, by, 6.0]]).map(drop)
    };
    let wrong = [
        (quaternion([0.0; 3], [0.0; 4]).map(drop), "a quaternion of length 0"),
        (quaternion([0.0; 3], [1e300, 0.0, 0.0, 1e300]).map(drop), "too long to be a rotation"),
        (quaternion([0.0, f64::NAN, 0.0], [0.0, 0.0, 0.0, 1.0]).map(drop), "NaN in a pose"),
        (quaternion([0.0; 3], [0.0, 0.0, f64::INFINITY, 1.0]).map(drop), "inf in a pose"),
        (scaled(1.001), "not a rotation"),
        (scaled(0.0), "not a rotation"),
        (scaled(-1.0), "not a rotation"),
        (scaled(1e200), "not a rotation"),
        (scaled(f64::NAN), "NaN in a pose"),
        (level([0.0, 0.0, 0.0, 2.0]).map(drop), "not 0 0 0 1"),
        (level([4.0, 5.0, 6.0, 1.0]).map(drop), "not 0 0 0 1"),
        (level([0.0, 0.0, 0.0, f64::NAN]).map(drop), "NaN in a pose"),
        (Pose::from_matrix(&[]).map(drop), "0 rows; a pose has 3 or 4"),
        (Pose::from_matrix(&[[0.0; 4]; 5]).map(drop), "5 rows"),
    ];
    for (outcome, reason) in wrong {
        let error = outcome.unwrap_err();
        assert!(matches!(&error, Error::InvalidArgument { argument, .. } if argument == "pose"), "{error}");
        assert!(error.to_string().contains(reason), "{error}");
    }
    assert_eq!(level([0.0, 0.0, 0.0, 1.0]).unwrap().position_m(), [4.0, 5.0, 6.0]);
    assert!(scaled(1.0004).is_ok());

    let random = &mut Random(3);
    for _ in 0..200 {
        let isometry = measured(random, 0, false).world_from_sensor;
        let pose = Pose::from(isometry);
        assert_eq!((pose.isometry(), Isometry3::from(pose)), (&isometry, isometry));
        let again = Pose::from_quaternion(pose.position_m(), pose.quaternion()).unwrap();
        let flat: Vec<f64> = isometry.to_homogeneous().transpose().iter().copied().collect();
        let rows = flat.as_chunks().0;
        let (whole, upper) = (Pose::from_matrix(rows).unwrap(), Pose::from_matrix(&rows[..3]).unwrap());
        assert_eq!(whole, upper);
        for other in [again, whole] {
            assert_eq!(other.position_m(), pose.position_m());
            assert!(other.isometry().rotation.angle_to(&isometry.rotation) < 1e-7);
            let point = random.point([0.0; 3], 10.0);
            let [a, b] = [pose, other].map(|pose| pose.to_world()(point));
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-9));
        }
        assert_eq!(pose.to_world()([0.0; 3]), pose.position_m());
    }
    assert_eq!(Pose::identity().to_world()([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
}
