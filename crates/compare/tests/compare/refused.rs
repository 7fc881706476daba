use crate::random_maps::random_map;
use std::ops::Range;
use testkit::support::message_of;
use voxtile::scan::{PointBatch, Stop};
use voxtile::{Aabb, Error, InMemoryMapper, MapConfig, Mapper};
use voxtile_compare::{
    CompareOptions, FrontierOptions, Viewpoints, compare, compare_span, count_blocks, frontiers, join_spans,
};

#[test]
fn invalid_arguments_are_refused() {
    let map = random_map(1, 1, 3.0);
    let with = |options: CompareOptions| compare(&map, &map, &options, &|_, _| {});
    for tolerance_m in [-0.1, -1e-9, 1.7, f64::NAN, f64::INFINITY] {
        let message = message_of(with(CompareOptions::default().with_tolerance(tolerance_m)));
        assert!(message.contains("from 0 to 1.6 m (16 voxels)"), "{message}");
    }
    for certainty in [0.5, 1.0, f64::NAN, -3.0] {
        let message = message_of(with(CompareOptions::default().with_certainty(certainty)));
        assert!(message.contains("above 0.5 and below 1"), "{message}");
    }
    for range_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let message = message_of(Viewpoints::new([], Some(range_m)));
        assert!(message.contains("a length above 0 m"), "{message}");
    }
    let coarse = InMemoryMapper::new(MapConfig::new(0.2, 10.0).unwrap()).unwrap();
    let message = message_of(compare(&map, &coarse, &CompareOptions::default(), &|_, _| {}));
    assert!(message.contains("0.1 m and 0.2 m"), "{message}");
}

#[test]
fn spans_of_other_blocks_are_refused() {
    let map = random_map(1, 1, 3.0);
    let options = CompareOptions::default();
    let blocks = count_blocks(&map, &map, &options).unwrap();
    assert!(blocks > 2, "{blocks}");
    let span = |range: Range<u64>| compare_span(&map, &map, &options, range, &|_, _| {}).unwrap();
    let all = [span(0..2), span(2..blocks + 7)];
    assert!(join_spans(&map, &map, &options, all.clone()).is_ok());
    for spans in
        [vec![span(0..2)], vec![all[1].clone(), all[0].clone()], [&all[..], &all[1..]].concat(), vec![]]
    {
        let message = message_of(join_spans(&map, &map, &options, spans));
        assert!(message.contains("spans"), "{message}");
    }
}

#[test]
fn empty_maps_boxes_without_voxels_and_the_ends_of_space_are_valid() {
    let empty = || InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    let nothing = compare(&empty(), &empty(), &CompareOptions::default(), &|_, _| {}).unwrap();
    assert!(nothing.changes.is_empty() && nothing.before.occupied == 0);
    let map = random_map(1, 1, 10.0);
    let only = compare(&map, &empty(), &CompareOptions::default(), &|_, _| {}).unwrap();
    assert!(only.before.not_seen == only.before.occupied && only.before.seen_share() == 0.0);
    let far = Aabb { min: [f64::NAN; 3], max: [1.0; 3] };
    assert_eq!(
        compare(&map, &map, &CompareOptions::default().with_region(far), &|_, _| {}).unwrap().before.occupied,
        0
    );
    assert_eq!(frontiers(&map, &FrontierOptions::default().with_region(far), &|_, _| {}).unwrap().free, 0);
    // The last voxels of the range of indices.
    for end_m in [-214_748_364.75, 214_748_364.55] {
        let mut map = empty();
        let batch = PointBatch { points: &[[end_m; 3]], intensities: None, is_occupied: &[true] };
        map.batch_update(&batch).unwrap();
        let all = compare(&map, &map, &CompareOptions::default().with_tolerance(1.6), &|_, _| {}).unwrap();
        assert_eq!((all.before.unchanged, all.before.occupied), (1, 1), "{end_m}");
        frontiers(&map, &FrontierOptions::default(), &|_, _| {}).unwrap();
        let positions = [[end_m; 3], [end_m, 0.0, 1e300], [f64::NAN; 3], [end_m * (1.0 - 1e-8); 3]];
        let viewpoints = [Some(1e9), Some(10.0)].map(|range_m| Viewpoints::new(positions, range_m).ok());
        let options = CompareOptions::default().with_viewpoints(viewpoints);
        let hidden = compare(&map, &empty(), &options, &|_, _| {}).unwrap().before;
        assert_eq!((hidden.not_seen, hidden.hidden), (1, Some(0)), "{end_m}");
    }
}

#[test]
fn a_stop_ends_the_comparison() {
    let stop = Stop::default();
    stop.set();
    let map = random_map(1, 1, 3.0);
    let stopped = compare(&map, &map, &CompareOptions::default().with_stop(stop.clone()), &|_, _| {});
    assert!(matches!(stopped, Err(Error::Stopped)));
    let stopped = frontiers(&map, &FrontierOptions::default().with_stop(stop), &|_, _| {});
    assert!(matches!(stopped, Err(Error::Stopped)));
}
