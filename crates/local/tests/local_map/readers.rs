use super::{at_once, crowded_scan};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, Ordering};
use testkit::random_scans::Random;
use testkit::reference_local::states_of;
use voxtile_local::{LocalMap, LocalParameters, LocalState};

#[test]
fn changes_lead_from_one_view_to_the_next() {
    let random = &mut Random(8);
    let mut map = LocalMap::new(
        0.1,
        at_once(LocalParameters::local_mapping().with_ranges(9.0, 2.0).with_max_voxels(400)),
    )
    .unwrap();
    let mut reader = map.reader();
    let mut seen = BTreeMap::new();
    for update in 0..60 {
        let scan = crowded_scan(random, [f64::from(update) * 0.3, 0.0, 0.0], 30);
        map.insert_scan(&scan).unwrap();
        if random.below(3) == 0 {
            continue;
        }
        let (view, changes) = reader.changes();
        assert_eq!(view.update_number(), update as u64 + 1);
        for change in changes {
            let before = seen.remove(&change.voxel).unwrap_or(LocalState::None);
            assert!(before == change.before && change.before != change.after);
            if change.after != LocalState::None {
                seen.insert(change.voxel, change.after);
            }
        }
        assert!(seen == states_of(&view));
    }
    let (_, changes) = reader.changes();
    let (_, none) = reader.changes();
    assert!(none.is_empty(), "{} then {}", changes.len(), none.len());
}

#[test]
fn readers_see_complete_updates_during_writes() {
    let random = &mut Random(9);
    // Everything is in the inflation range, so that every occupied voxel is inflated.
    let mut map =
        LocalMap::new(0.1, at_once(LocalParameters::passive_perception().with_max_voxels(2000))).unwrap();
    let is_done = AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..2 {
            let mut reader = map.reader();
            let is_done = &is_done;
            scope.spawn(move || {
                let (mut last, mut views) = (0, 0);
                while !is_done.load(Ordering::Relaxed) || views == 0 {
                    let (view, _) = reader.changes();
                    assert!(view.update_number() >= last);
                    last = view.update_number();
                    views += 1;
                    // The counts are those of the complete update, so a view of a partial update would differ from
                    // them.
                    let states = states_of(&view);
                    let occupied = states.values().filter(|state| **state == LocalState::Occupied).count();
                    assert_eq!(occupied, view.occupied_voxels());
                    assert_eq!(states.len(), view.inflated_voxels());
                }
            });
        }
        for update in 0..150 {
            map.insert_scan(&crowded_scan(random, [f64::from(update % 9), 0.0, 0.0], 40)).unwrap();
        }
        is_done.store(true, Ordering::Relaxed);
    });
}

#[test]
fn a_view_never_changes() {
    let random = &mut Random(10);
    let mut map = LocalMap::new(0.1, at_once(LocalParameters::local_mapping())).unwrap();
    map.insert_scan(&crowded_scan(random, [0.0; 3], 80)).unwrap();
    let (view, before) = (map.view().clone(), states_of(map.view()));
    for _ in 0..5 {
        map.insert_scan(&crowded_scan(random, [1.0, 0.0, 0.0], 80)).unwrap();
    }
    assert!(states_of(&view) == before && states_of(map.view()) != before);
}
