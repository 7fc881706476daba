use super::{assert_equal, at_once, crowded_scan};
use std::collections::BTreeSet;
use testkit::random_scans::Random;
use testkit::reference_local::{ReferenceLocal, states_of};
use testkit::support::{fixtures, shared_data};
use voxtile::Scan;
use voxtile::maths::logit;
use voxtile::space::{Point, VoxelIndex};
use voxtile_formats::{ReadOptions, open_scans};
use voxtile_local::{LocalMap, LocalParameters};

fn pick<T: Copy>(random: &mut Random, choices: &[T]) -> T {
    choices[random.below(choices.len() as u64) as usize]
}

/// Changes one or several parameters.
fn change(random: &mut Random, p: &mut LocalParameters) {
    for _ in 0..1 + random.below(3) {
        match random.below(9) {
            0 => p.initial_probability = pick(random, &[0.3, 0.5, 0.7]),
            1 => p.log_odds.hit = pick(random, &[0.4, 0.85, 2.0]),
            2 => p.log_odds.miss = pick(random, &[-0.2, -0.4, -1.5]),
            3 => (p.log_odds.min, p.log_odds.max) = pick(random, &[(-2.0, 3.5), (-1.0, 1.2), (-5.0, 8.0)]),
            4 => p.occupied_log_odds = pick(random, &[0.0, 0.5, 1.0, -0.3]),
            5 => p.free_log_odds = pick(random, &[logit(0.4), -0.9, -0.3]),
            6 => p.max_voxels = pick(random, &[None, Some(1), Some(150), Some(600), Some(2000)]),
            7 => {
                p.input_range_m = pick(random, &[f64::INFINITY, 3.0, 1.5]);
                p.inflation_range_m = pick(random, &[f64::INFINITY, 0.0, 1.0, 2.5, 4.0]);
            }
            _ => p.inflation_radius_m = pick(random, &[0.0, 0.1, 0.2, 0.25, 0.3, 0.45]),
        }
    }
}

#[test]
fn the_map_equals_the_naive_one_while_parameters_change() {
    for seed in 0..8 {
        let random = &mut Random(seed);
        let mut parameters = at_once(LocalParameters::local_mapping());
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        let mut naive = ReferenceLocal::new(0.1, parameters);
        // The sensor moves across page borders and across index 0.
        let mut center = random.point([0.0, -6.4, 6.4], 1.0);
        for update in 0..40 {
            if random.below(3) == 0 {
                change(random, &mut parameters);
                map.set_parameters(parameters).unwrap();
                naive.parameters = parameters;
            }
            let step = if random.below(8) == 0 { 5.0 } else { 0.4 };
            center = random.point(center, step);
            let points = random.below(60) as usize;
            let scan = crowded_scan(random, center, points);
            if random.below(6) == 0 {
                map.insert_relayed(scan.origin, &scan.points).unwrap();
                naive.update(scan.origin, &scan.points, false);
            } else {
                map.insert_scan(&scan).unwrap();
                naive.insert_scan(&scan);
            }
            assert_equal(&map, &naive, &format!("after update {update} of life {seed}"));
        }
    }
}

#[test]
fn a_wide_ball_counts_beyond_255() {
    let random = &mut Random(5);
    let parameters = at_once(LocalParameters::passive_perception().with_inflation_radius(0.7));
    let mut map = LocalMap::new(0.1, parameters).unwrap();
    let mut naive = ReferenceLocal::new(0.1, parameters);
    for update in 0..6 {
        // A solid block of voxels, which later rays clear again.
        let points: Vec<Point> = (0..1200).map(|_| random.point([3.0, 0.0, 0.0], 0.5)).collect();
        let points = if update < 3 { points } else { vec![[5.0, 0.0, 0.0]; 300] };
        let scan = Scan { origin: [0.0, 0.02, 0.03], points, intensities: None };
        map.insert_scan(&scan).unwrap();
        naive.insert_scan(&scan);
        assert_equal(&map, &naive, &format!("after update {update}"));
    }
}

#[test]
fn a_change_with_a_work_limit_takes_several_updates_and_gives_the_same_map() {
    for seed in 0..6 {
        let random = &mut Random(100 + seed);
        let mut parameters = LocalParameters::passive_perception().with_max_voxels(None);
        parameters.work_per_update = 40;
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        let mut naive = ReferenceLocal::new(0.1, parameters);
        for _ in 0..12 {
            let scan = crowded_scan(random, [0.0; 3], 120);
            map.insert_scan(&scan).unwrap();
            naive.insert_scan(&scan);
        }
        assert_equal(&map, &naive, "before the change");
        let before = parameters;
        let mut changed_at = 0;
        for update in 0.. {
            assert!(update < 2000, "the change never ends");
            if update == 3 || (update == 6 && seed % 2 == 0) {
                // Parameters also change while an earlier change is still being applied.
                change(random, &mut parameters);
                (parameters.inflation_radius_m, parameters.inflation_range_m) =
                    if update == 3 { (0.1, 3.0) } else { (0.3, f64::INFINITY) };
                map.set_parameters(parameters).unwrap();
                naive.parameters = parameters;
                changed_at = update;
            }
            // An empty scan adds no evidence, so the update only applies the change of parameters.
            let report = map.insert_scan(&super::scan([0.0; 3], &[])).unwrap();
            naive.insert_scan(&super::scan([0.0; 3], &[]));
            // A node is processed as a whole, so the limit can be exceeded by twice the voxels of a node.
            assert!(report.inflation_changes < 2000, "{} changes", report.inflation_changes);
            assert!(
                changed_at < 3 || update > changed_at + 1 || !report.is_settled,
                "the work limit has no effect"
            );
            let _ = before;
            if changed_at >= 3 && report.is_settled && update > 6 {
                break;
            }
        }
        assert_equal(&map, &naive, "when it is settled");
    }
}

#[test]
fn every_voxel_has_the_old_or_the_new_radius_during_a_change() {
    let random = &mut Random(77);
    let mut parameters = LocalParameters::passive_perception().with_max_voxels(None);
    parameters.work_per_update = 60;
    let mut map = LocalMap::new(0.1, parameters).unwrap();
    let mut naive = ReferenceLocal::new(0.1, parameters);
    let mut was_between = false;
    for update in 0..60 {
        if update % 20 == 10 {
            let radius_m = if parameters.inflation_radius_m == 0.2 { 0.3 } else { 0.2 };
            parameters = parameters.with_inflation_radius(radius_m);
            map.set_parameters(parameters).unwrap();
            naive.parameters = parameters;
        }
        let scan = crowded_scan(random, [0.0; 3], 40);
        let report = map.insert_scan(&scan).unwrap();
        naive.insert_scan(&scan);
        let inflated: BTreeSet<VoxelIndex> = states_of(map.view()).into_keys().collect();
        let [narrow, wide] = [0.2, 0.3].map(|radius_m| naive.dilation(f64::INFINITY, radius_m));
        assert!(narrow.is_subset(&inflated) && inflated.is_subset(&wide));
        was_between |= inflated != narrow && inflated != wide;
        if report.is_settled {
            assert_equal(&map, &naive, "when settled");
        }
    }
    assert!(was_between);
}

#[test]
fn removed_voxels_inflate_again_when_they_return() {
    let parameters = at_once(LocalParameters::passive_perception().with_max_voxels(Some(1)));
    let mut map = LocalMap::new(0.1, parameters).unwrap();
    let mut naive = ReferenceLocal::new(0.1, parameters);
    // The first point inflates across a border of nodes; the second removes what is left of it.
    for (update, point) in [[1.65, 0.85, 0.85], [30.05, 0.85, 0.85]].into_iter().cycle().take(6).enumerate() {
        map.insert_relayed([0.0; 3], &[point]).unwrap();
        naive.update([0.0; 3], &[point], false);
        assert_equal(&map, &naive, &format!("after update {update}"));
    }
}

#[test]
fn real_scans_give_the_naive_map() {
    let recorded = ["fastlio_hku_1", "mulran_riverside02_a", "balm_os0_hall"].map(shared_data);
    for folder in recorded.into_iter().flatten().chain([fixtures("scans_1")]) {
        let parameters = at_once(LocalParameters::local_mapping().with_max_voxels(4000));
        let mut map = LocalMap::new(0.1, parameters).unwrap();
        let mut naive = ReferenceLocal::new(0.1, parameters);
        let mut source = open_scans(&folder, &ReadOptions::default()).unwrap();
        for number in 0..6 {
            let mut scan = source.next_scan().unwrap().unwrap().into_scan();
            let every = scan.points.len() / 1500;
            scan.points = scan.points.into_iter().step_by(every.max(1)).collect();
            map.insert_scan(&scan).unwrap();
            naive.insert_scan(&scan);
            assert_equal(&map, &naive, &format!("after scan {number} of {}", folder.display()));
        }
    }
}

#[test]
fn rays_along_borders_edges_and_corners_equal_the_walk() {
    for seed in 0..60 {
        let random = &mut Random(1000 + seed);
        let parameters = at_once(LocalParameters::passive_perception().with_inflation_radius(0.0));
        let mut map = LocalMap::new(1.0, parameters).unwrap();
        let mut naive = ReferenceLocal::new(1.0, parameters);
        // Points and origins on whole, half and quarter voxels: nearly all crossings are ties.
        let unit = [1.0, 0.5, 0.25][seed as usize % 3];
        let snapped = |random: &mut Random, reach: f64| -> Point {
            [0; 3].map(|_| (random.between(-reach, reach) / unit).round() * unit)
        };
        for update in 0..6 {
            let origin = snapped(random, 20.0);
            let mut points: Vec<Point> = (0..80).map(|_| snapped(random, 70.0)).collect();
            points.extend((0..20).map(|_| {
                let mut point = origin;
                point[random.below(3) as usize] += random.between(-60.0, 60.0).round();
                point[random.below(3) as usize] += [0.0, 1e-12, -1e-12, 1e-200][random.below(4) as usize];
                point
            }));
            let scan = super::scan(origin, &points);
            map.insert_scan(&scan).unwrap();
            naive.insert_scan(&scan);
            assert_equal(&map, &naive, &format!("after update {update} of {seed}"));
        }
    }
}
