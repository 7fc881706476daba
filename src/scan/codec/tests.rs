use super::*;
use crate::scan::{AttributeSlices, NO_TIME, PointAttributes};
use crate::space::Point;
use proptest::prelude::*;

fn encoded(points: &[Point], intensities: Option<&[f32]>) -> Vec<u8> {
    let mut block = Vec::new();
    PointEncoder::default().encode(points, intensities, AttributeSlices::default(), &mut block).unwrap();
    block
}

/// Returns the encoded size in bytes after checking a lossless round trip.
fn round_trip(points: &[Point], intensities: Option<&[f32]>) -> usize {
    let block = encoded(points, intensities);
    let (mut decoded, mut of_decoded) = (Vec::new(), Vec::new());
    let has = PointDecoder::default()
        .decode(&block, &mut decoded, &mut of_decoded, &mut PointAttributes::default())
        .unwrap();
    assert_eq!(has, intensities.is_some());
    let bits = |points: &[Point]| points.iter().map(|point| point.map(f64::to_bits)).collect::<Vec<_>>();
    assert!(bits(&decoded) == bits(points), "{} points", points.len());
    let wanted: Vec<u32> = intensities.unwrap_or_default().iter().map(|x| x.to_bits()).collect();
    assert_eq!(of_decoded.iter().map(|x| x.to_bits()).collect::<Vec<_>>(), wanted);
    block.len()
}

/// Random number generator (SplitMix64).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (*state ^ *state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

fn unit(state: &mut u64) -> f64 {
    (random(state) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Points of one lidar revolution: similar neighbours and noisy ranges.
fn turn(points: usize, state: &mut u64) -> Vec<Point> {
    let point = |k: usize| {
        let (angle, up) = (k as f64 * 1e-3, (k % 16) as f64 * 0.03 - 0.2);
        let range = 8.0 + 4.0 * (3.0 * angle).sin() + 0.02 * unit(state);
        [range * angle.cos(), range * angle.sin(), range * up]
    };
    (0..points).map(point).collect()
}

#[test]
fn all_kinds_of_blocks_round_trip_losslessly() {
    let state = &mut 1;
    for points in [0, 1, 2, 5, 255, 4096, MAX_POINTS] {
        let turn = turn(points, state);
        let narrow: Vec<Point> = turn.iter().map(|point| point.map(|x| f64::from(x as f32))).collect();
        let millimetres: Vec<Point> =
            turn.iter().map(|point| point.map(|x| (x * 1e3).round() * 1e-3)).collect();
        let survey: Vec<Point> = turn
            .iter()
            .map(|point| {
                std::array::from_fn(|k| (point[k] * 100.0).round() * 0.01 + [512_000.0, 5.4e6, 30.0][k])
            })
            .collect();
        let noise: Vec<Point> = turn.iter().map(|_| [0; 3].map(|_| f64::from_bits(random(state)))).collect();
        let constant = vec![[1.5, -0.0, f64::INFINITY]; points];
        let intensities: Vec<f32> = turn.iter().map(|_| (random(state) % 200) as f32).collect();
        let bits: Vec<f32> = turn.iter().map(|_| f32::from_bits(random(state) as u32)).collect();
        for scan in [&turn, &narrow, &millimetres, &survey, &noise, &constant] {
            round_trip(scan, None);
            round_trip(scan, Some(&intensities));
            round_trip(scan, Some(&bits));
        }
    }
}

#[test]
fn values_on_a_grid_are_stored_as_integers() {
    let points = 30_000;
    let turn = turn(points, &mut 2);
    let a_point = |scan: &[Point]| round_trip(scan, None) as f64 / points as f64;
    let millimetres: Vec<Point> = turn.iter().map(|point| point.map(|x| (x * 1e3).round() * 1e-3)).collect();
    assert!(a_point(&millimetres) < 6.0, "{}", a_point(&millimetres));
    let as_f32: Vec<Point> = millimetres.iter().map(|point| point.map(|x| f64::from(x as f32))).collect();
    assert!(a_point(&as_f32) < 6.0, "{}", a_point(&as_f32));
    let narrow: Vec<Point> = turn.iter().map(|point| point.map(|x| f64::from(x as f32))).collect();
    assert!(a_point(&narrow) < 11.0, "{}", a_point(&narrow));
}

/// The international foot, the US survey foot, and its usual rounding.
const FEET_M: [f64; 3] = [0.3048, 1200.0 / 3937.0, 0.304_800_609_6];

/// Points of a survey in feet, as readers convert them to metres.
fn survey_in_feet(points: usize, foot_m: f64, state: &mut u64) -> Vec<Point> {
    let in_feet = |point: Point, axis: usize| {
        ((point[axis] * 328.0).round() * 0.01 + [1_640_416.0, 638_000.5, 420.25][axis]) * foot_m
    };
    turn(points, state).into_iter().map(|point| std::array::from_fn(|axis| in_feet(point, axis))).collect()
}

#[test]
fn values_in_feet_are_stored_as_integers() {
    let points = 30_000;
    for foot_m in FEET_M {
        let a_point = round_trip(&survey_in_feet(points, foot_m, &mut 5), None) as f64 / points as f64;
        assert!(a_point < 5.0, "{a_point} bytes a point");
    }
}

#[test]
fn a_value_off_the_grid_leaves_the_others_on_it() {
    let (points, state) = (30_000, &mut 6);
    let odd =
        [f64::NAN, f64::INFINITY, -0.0, 5e-324, 1e300, 0.123_456_789, f64::from_bits(0x7ff0_0000_0000_0001)];
    let narrow_odd = [f32::NAN, f32::NEG_INFINITY, -0.0, 1e-45, f32::MAX, 0.123_456_79].map(f64::from);
    let wide: Vec<Point> =
        turn(points, state).iter().map(|point| point.map(|x| (x * 1e3).round() * 1e-3)).collect();
    let narrow = wide.iter().map(|point| point.map(|x| f64::from(x as f32))).collect();
    for (mut grid, odd) in [(wide, &odd[..]), (narrow, &narrow_odd)] {
        let without = round_trip(&grid, None);
        for at in (7..points).step_by(300) {
            grid[at][at % 3] = odd[at % odd.len()];
        }
        let with = round_trip(&grid, None);
        assert!(with < without + points / 30, "{without} bytes, then {with}");
        // Points without a return, as some drivers write them.
        for at in (0..points).step_by(20) {
            grid[at] = [f64::from(f32::NAN); 3];
        }
        let with = round_trip(&grid, None);
        assert!(with < without + points, "{without} bytes, then {with}");
        // Most values are off the grid.
        for at in (0..points).filter(|at| at % 5 > 0) {
            grid[at] = [0; 3].map(|_| unit(state));
        }
        round_trip(&grid, None);
    }
}

#[test]
fn blocks_of_version_1_are_read() {
    // Five points: x as differences of `f64`, y of `f32`, z as integers of a grid; intensities.
    let block = "010105810100807f007f8000009e33d10a00002b335ff80000e23315af0000be33f18a00002b335ff80000e23315af00\
                 00be32f18c830000000000408f400200090000000000c4020202020200030000000000002440010000060606060200030\
                 000000000001040010008080b033a0200";
    let digits: Vec<u8> =
        block.bytes().filter_map(|byte| (byte as char).to_digit(16)).map(|x| x as u8).collect();
    let block: Vec<u8> = digits.chunks(2).map(|pair| pair[0] << 4 | pair[1]).collect();
    let point = |k: f64| {
        let z = if k == 3.0 { -0.0 } else { 0.1 * k + k * k / 7.0 };
        [1.25 + k * 0.001, f64::from((0.3 * k) as f32), z]
    };
    let (mut points, mut intensities) = (Vec::new(), Vec::new());
    PointDecoder::default()
        .decode(&block, &mut points, &mut intensities, &mut PointAttributes::default())
        .unwrap();
    let wanted: Vec<Point> = (0..5).map(|k| point(f64::from(k))).collect();
    assert_eq!(
        points.iter().map(|x| x.map(f64::to_bits)).collect::<Vec<_>>(),
        wanted.iter().map(|x| x.map(f64::to_bits)).collect::<Vec<_>>()
    );
    assert_eq!(intensities, [1.0, 2.0, 0.5, 0.0, 7.25]);
}

#[test]
fn depth_images_are_stored_as_pixels() {
    for (focal, center) in [([585.0, 585.0], [320.0, 240.0]), ([517.3, 516.5], [318.6, 255.3])] {
        let (mut points, state) = (Vec::new(), &mut 3);
        for row in 100..180 {
            for column in (0..640).filter(|column| (row + column) % 11 > 0) {
                let z = (1500 + (column / 3 + row) % 400 + (random(state) % 4) as usize) as f64 * 0.001;
                let direction = [(column as f64 - center[0]) / focal[0], (row as f64 - center[1]) / focal[1]];
                points.push([direction[0] * z, direction[1] * z, z]);
            }
        }
        points.truncate(MAX_POINTS);
        let a_point = round_trip(&points, None) as f64 / points.len() as f64;
        assert!(a_point < 2.5, "{a_point} bytes a point");
    }
}

#[test]
fn damaged_blocks_are_errors_or_points() {
    let turn = turn(3000, &mut 4);
    let intensities: Vec<f32> = (0..3000).map(|k| (k % 97) as f32).collect();
    let grid: Vec<Point> = turn.iter().map(|point| point.map(|x| (x * 1e3).round() * 1e-3)).collect();
    let feet = survey_in_feet(3000, FEET_M[1], &mut 8);
    let mut some_off = grid.clone();
    some_off.iter_mut().step_by(40).for_each(|point| *point = [f64::NAN; 3]);
    for scan in [&turn, &grid, &feet, &some_off] {
        let block = encoded(scan, Some(&intensities));
        let decode = |block: &[u8]| {
            let (mut points, mut of_points) = (Vec::new(), Vec::new());
            PointDecoder::default()
                .decode(block, &mut points, &mut of_points, &mut PointAttributes::default())
                .is_ok()
        };
        for length in (0..block.len()).step_by(37) {
            assert!(!decode(&block[..length]), "{length}");
        }
        for at in (0..block.len()).step_by(13) {
            let mut changed = block.clone();
            changed[at] ^= 1 << (at % 8);
            decode(&changed);
        }
    }
}

/// Numbers as sensors return them, and arbitrary ones.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        any::<u32>().prop_map(|bits| f64::from(f32::from_bits(bits))),
        (-100_000_i32..100_000).prop_map(|steps| f64::from(steps) * 0.001),
        (-100_000_i32..100_000).prop_map(|steps| f64::from(steps) * 0.01 * 0.3048),
        (-100.0..100.0_f64),
        prop::sample::select(vec![0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, 5e-324, f64::MAX]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn any_points_round_trip_losslessly(
        points in prop::collection::vec(prop::array::uniform3(number()), 0..300),
        is_with_intensities in prop::bool::ANY,
        seed in any::<u64>(),
    ) {
        let mut state = seed;
        let intensities: Vec<f32> = points.iter().map(|_| f32::from_bits(random(&mut state) as u32)).collect();
        round_trip(&points, is_with_intensities.then_some(&*intensities));
    }

    #[test]
    fn any_bytes_decode_to_an_error_or_points(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        let mut block = vec![VERSION, 1];
        block.extend(&bytes);
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        let _ = PointDecoder::default().decode(&block, &mut points, &mut intensities, &mut PointAttributes::default());
        prop_assert!(points.len() <= MAX_POINTS);
    }
}

/// Prints bytes per point and times for the real data sets: `cargo test --release --lib codec -- --ignored
/// --nocapture`.
#[test]
#[ignore = "prints a table; run manually"]
fn print_sizes_and_times_of_real_sets() {
    use std::time::Instant;
    use voxtile_formats::{ReadOptions, open_scans};
    let root = std::env::var_os("VOXTILE_DATA").unwrap_or_else(|| "../shared/data".into());
    for set in [
        "balm_os0_hall",
        "fastlio_hku_1",
        "mulran_riverside02_a",
        "sevenscenes_kinect",
        "las_large_coords/lone-star.laz",
        "las_large_coords/lidR_Megaplot.laz",
        "las_large_coords/autzen_trim.laz",
        "las_large_coords/pdal_4_6_crop.las",
        "kitti_0001_a",
    ] {
        let poses = set.ends_with("laz").then(|| "identity".into());
        let options = ReadOptions { poses, ..ReadOptions::default() };
        let Ok(mut source) = open_scans(&std::path::Path::new(&root).join(set), &options) else {
            continue;
        };
        let (mut encoder, mut decoder) = (PointEncoder::default(), PointDecoder::default());
        let (mut count, mut bytes, mut encoding_s, mut decoding_s) = (0, 0, 0.0, 0.0);
        while let Some(scan) = source.next_scan().unwrap() {
            for (number, points) in scan.points_in_sensor.chunks(MAX_POINTS).enumerate() {
                let first = number * MAX_POINTS;
                let of_points = scan.intensities.as_ref().map(|all| &all[first..first + points.len()]);
                let (mut block, began) = (Vec::new(), Instant::now());
                encoder.encode(points, of_points, AttributeSlices::default(), &mut block).unwrap();
                encoding_s += began.elapsed().as_secs_f64();
                let (mut decoded, mut of_decoded, began) = (Vec::new(), Vec::new(), Instant::now());
                decoder
                    .decode(&block, &mut decoded, &mut of_decoded, &mut PointAttributes::default())
                    .unwrap();
                decoding_s += began.elapsed().as_secs_f64();
                count += points.len();
                bytes += block.len();
            }
        }
        let [encoding, decoding] = [encoding_s, decoding_s].map(|s| 1e9 * s / count as f64);
        let a_point = bytes as f64 / count as f64;
        let line = format!("{set:36} {count:9} {a_point:6.2} bytes {encoding:6.1} ns {decoding:6.1} ns\n");
        std::io::Write::write_all(&mut std::io::stderr(), line.as_bytes()).unwrap();
    }
}

#[test]
fn attributes_round_trip() {
    let points = turn(3000, &mut 3);
    let colours: Vec<_> = (0..3000).map(|k| (k % 7 > 0).then_some([k as u8, (k / 3) as u8, 255])).collect();
    let classes: Vec<_> = (0..3000).map(|k| (k % 5 > 0).then_some((k / 300) as u8)).collect();
    let times_ns: Vec<_> = (0..3000).map(|k| 55_296 * k - 1_000_000).collect();
    let odd_times = [NO_TIME, i64::MAX, 0, -1, NO_TIME].into_iter().cycle().take(3000).collect();
    let cases = [
        (true, true, Vec::new()),
        (true, false, times_ns.clone()),
        (false, true, odd_times),
        (false, false, vec![0; 3000]),
        (false, false, times_ns),
    ];
    for (has_colours, has_classes, times_ns) in cases {
        let attributes = PointAttributes {
            colours: if has_colours { colours.clone() } else { Vec::new() },
            classes: if has_classes { classes.clone() } else { Vec::new() },
            times_ns,
        };
        let (mut block, mut decoded, mut intensities) = Default::default();
        PointEncoder::default().encode(&points, None, attributes.all(), &mut block).unwrap();
        let mut found = PointAttributes::default();
        PointDecoder::default().decode(&block, &mut decoded, &mut intensities, &mut found).unwrap();
        assert!(decoded == points && found == attributes);
    }
}
