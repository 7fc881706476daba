use super::*;
use crate::spill::{FilePart, PoseList};

const S: i64 = 1_000_000_000;

fn at(x: f64) -> RigidPose {
    RigidPose { position_m: [x, 0.1, 0.2], quaternion: [0.0, 0.0, 0.6, 0.8] }
}

fn moving(tf: &mut Transforms, parent: &str, child: &str, stamps_ns: &[i64], x: f64) {
    for &stamp_ns in stamps_ns {
        tf.insert(parent, child, stamp_ns, at(x), false).unwrap();
    }
}

fn fixed(tf: &mut Transforms, parent: &str, child: &str, pose: RigidPose) {
    tf.insert(parent, child, 0, pose, true).unwrap();
}

/// A robot that drives for a second: map, odom, base, lidar.
fn robot() -> Transforms {
    let mut tf = Transforms::default();
    tf.set_most_gap_ns(Some(S / 10));
    let stamps: Vec<i64> = (0..=50).map(|tick| tick * S / 50).collect();
    fixed(&mut tf, "base", "lidar", at(0.2));
    moving(&mut tf, "map", "odom", &stamps, 1.0);
    moving(&mut tf, "odom", "base", &stamps, 2.0);
    tf
}

const MIDDLE: i64 = S / 2 + 7_000_000;

#[test]
fn exact_stamps_keep_every_bit() {
    let mut tf = Transforms::default();
    moving(&mut tf, "/odom", "base", &[5], 0.3);
    moving(&mut tf, "odom", "base", &[9], 0.7);
    fixed(&mut tf, "base", "lidar", RigidPose::IDENTITY);
    assert_eq!(tf.lookup("odom", "/lidar", 5), Ok(at(0.3)));
    assert_eq!(tf.lookup("odom", "lidar", 7).unwrap().position_m[0], 0.5);
    assert_eq!(tf.lookup("base", "base", 1), Ok(RigidPose::IDENTITY));
    let back = tf.lookup("lidar", "odom", 5).unwrap();
    assert!(back.then(&at(0.3)).position_m.iter().all(|m| m.abs() < 1e-12));
}

#[test]
fn poses_are_not_extrapolated() {
    let mut tf = Transforms::default();
    moving(&mut tf, "odom", "base", &[5, 9], 0.3);
    assert_eq!(tf.lookup("odom", "base", 4), Err(WhyNot::Before("base".into())));
    assert_eq!(tf.lookup("odom", "base", 10), Err(WhyNot::After("base".into())));
    tf.set_most_gap_ns(Some(3));
    assert_eq!(tf.lookup("odom", "base", 7), Err(WhyNot::Gap("base".into())));
    assert!(tf.lookup("odom", "base", 9).is_ok());
    assert_eq!(tf.lookup("odom", "camera", 9), Err(WhyNot::UnknownFrame("camera".into())));
    fixed(&mut tf, "rig", "camera", at(1.0));
    assert!(matches!(tf.lookup("odom", "camera", 9), Err(WhyNot::NotConnected(..))));
}

#[test]
fn each_link_keeps_its_own_last_seconds() {
    let mut tf = Transforms::default();
    moving(&mut tf, "odom", "base", &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 0.3);
    moving(&mut tf, "map", "odom", &[2], 0.7);
    fixed(&mut tf, "base", "lidar", RigidPose::IDENTITY);
    assert_eq!((tf.forget_older_than(3), tf.frames()), (6, 3));
    assert_eq!(tf.lookup("odom", "lidar", 5), Err(WhyNot::Before("base".into())));
    assert_eq!(tf.lookup("odom", "lidar", 6), Ok(at(0.3)));
    assert_eq!(tf.lookup("map", "odom", 2), Ok(at(0.7)));
}

#[test]
fn frame_with_most_samples_drops_the_older_half() {
    let mut tf = Transforms::default();
    moving(&mut tf, "odom", "base", &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9], 0.3);
    moving(&mut tf, "map", "odom", &[2], 0.7);
    fixed(&mut tf, "base", "lidar", RigidPose::IDENTITY);
    assert_eq!(tf.shrink_largest(), 5);
    assert_eq!(tf.lookup("odom", "base", 4), Err(WhyNot::Before("base".into())));
    assert_eq!(tf.lookup("odom", "lidar", 5), Ok(at(0.3)));
    while tf.shrink_largest() > 0 {}
    assert_eq!((tf.frames(), tf.forget_older_than(S)), (1, 1), "static transforms are kept");
}

#[test]
fn invalid_transforms_are_refused() {
    let mut tf = Transforms::default();
    let put = |tf: &mut Transforms, parent: &str, child: &str, pose| tf.insert(parent, child, 5, pose, true);
    assert_eq!(put(&mut tf, "/base", "base", at(0.3)), Err(BadTransform::InItself("base".into())));
    assert_eq!(put(&mut tf, "base", "//", at(0.3)), Err(BadTransform::NoName));
    assert_eq!(put(&mut tf, "", "base", at(0.3)), Err(BadTransform::NoName));
    let broken = RigidPose { position_m: [f64::NAN; 3], ..RigidPose::IDENTITY };
    let long = RigidPose { quaternion: [0.3, 7.0, 2.0, 9.0], ..RigidPose::IDENTITY };
    for pose in [broken, long, RigidPose { quaternion: [0.0; 4], ..RigidPose::IDENTITY }] {
        assert_eq!(put(&mut tf, "base", "wheel", pose), Err(BadTransform::Pose("wheel".into())));
    }
    assert!(tf.is_empty());
}

#[test]
fn transforms_closing_a_loop_change_no_pose() {
    let wanted = robot().lookup("map", "lidar", MIDDLE).unwrap();
    let links = [
        ("lidar", "map"),
        ("base", "map"),
        ("lidar", "odom"),
        ("lidar", "base"),
        ("foo", "lidar"),
        ("map", "lidar"),
        ("foo", "base"),
        ("map", "base"),
        ("lidar", "foo"),
    ];
    for (parent, child) in links {
        for is_static in [false, true] {
            // These transforms may change the pose: a static link to the map, or a stamp between two samples.
            if is_static && (parent, child) == ("map", "lidar") {
                continue;
            }
            let mut before = Transforms::default();
            before.insert(parent, child, MIDDLE, at(50.0), is_static).unwrap();
            let mut after = robot();
            after.insert(parent, child, MIDDLE, at(50.0), is_static).unwrap();
            let stamps: Vec<i64> = (0..=50).map(|tick| tick * S / 50).collect();
            before.set_most_gap_ns(Some(S / 10));
            moving(&mut before, "odom", "base", &stamps, 2.0);
            moving(&mut before, "map", "odom", &stamps, 1.0);
            fixed(&mut before, "base", "lidar", at(0.2));
            for (tf, when) in [(&before, "before"), (&after, "after")] {
                let found = tf.lookup("map", "lidar", MIDDLE);
                assert_eq!(found, Ok(wanted), "{child} in {parent}, static {is_static}, {when}");
            }
        }
    }
}

#[test]
fn mutual_parents_give_the_requested_pose() {
    let mut tf = Transforms::default();
    moving(&mut tf, "odom", "base", &[5, 6], 0.3);
    fixed(&mut tf, "base", "odom", at(0.9));
    assert_eq!(tf.lookup("odom", "base", 5), Ok(at(0.3)));
    fixed(&mut tf, "lid", "lens", at(0.1));
    fixed(&mut tf, "lens", "lid", at(0.1));
    assert!(matches!(tf.lookup("odom", "lens", 5), Err(WhyNot::Loop(_))));
}

#[test]
fn inverted_trees_tolerate_loops() {
    let mut tf = Transforms::default();
    moving(&mut tf, "base", "odom", &[5, 9], 0.3);
    fixed(&mut tf, "base", "lidar", at(0.2));
    let wanted = tf.lookup("odom", "lidar", 7).unwrap();
    moving(&mut tf, "odom", "base", &[7], 0.9);
    assert_eq!(tf.lookup("odom", "lidar", 7), Ok(wanted));
}

#[test]
fn reparenting_keeps_earlier_poses() {
    let mut tf = Transforms::default();
    moving(&mut tf, "odom", "base", &[10, 20, 30], 0.3);
    moving(&mut tf, "map", "odom", &[10, 20, 30, 40, 50], 1.0);
    let early = tf.lookup("map", "base", 25).unwrap();
    moving(&mut tf, "map", "base", &[30, 40, 50], 0.9);
    assert_eq!((tf.lookup("map", "base", 25), tf.lookup("map", "base", 45)), (Ok(early), Ok(at(0.9))));
}

#[test]
fn static_transforms_are_used_before_and_long_after_motion() {
    let mut tf = Transforms::default();
    fixed(&mut tf, "map", "odom", at(0.1));
    moving(&mut tf, "map", "odom", &[S], 0.5);
    assert_eq!(tf.lookup("map", "odom", S), Ok(at(0.1)), "a single sample is not trusted");
    moving(&mut tf, "map", "odom", &[2 * S], 0.5);
    assert_eq!(tf.lookup("map", "odom", S / 2), Ok(at(0.1)));
    assert_eq!(tf.lookup("map", "odom", S + 1), Ok(at(0.5)));
    assert_eq!(tf.lookup("map", "odom", 2 * S + 1), Err(WhyNot::After("odom".into())));
    assert_eq!(tf.lookup("map", "odom", 13 * S), Ok(at(0.1)));
    fixed(&mut tf, "world", "odom", at(0.7));
    assert_eq!(tf.lookup("world", "odom", 13 * S), Ok(at(0.7)));
    assert_eq!(tf.lookup("map", "odom", 13 * S), Ok(at(0.1)), "parents that do not lead there are ignored");
}

#[test]
fn alternating_parents_keep_the_path_to_the_map() {
    let mut tf = robot();
    let wanted = tf.lookup("map", "lidar", MIDDLE).unwrap();
    for tick in 0..1000 {
        let parent = ["foo", "lidar", "bar"][tick as usize % 3];
        moving(&mut tf, parent, "base", &[tick * S / 1000], 9.0);
    }
    assert_eq!(tf.lookup("map", "lidar", MIDDLE), Ok(wanted));
    for parent in 0..1000 {
        moving(&mut tf, &format!("p{parent}"), "base", &[MIDDLE], 9.0);
        fixed(&mut tf, &format!("p{parent}"), "lidar", at(9.0));
    }
    assert_eq!(tf.lookup("map", "lidar", MIDDLE), Ok(wanted));
    assert!(tf.forget_older_than(S) < 51 * 2 + 1000 + 40, "parents of a frame are bounded");
}

#[test]
fn searches_in_deep_chains_terminate() {
    let mut tf = robot();
    for frame in 0..30_000 {
        fixed(&mut tf, &(frame + 1).to_string(), &frame.to_string(), RigidPose::IDENTITY);
    }
    fixed(&mut tf, "0", "map", at(0.1));
    assert!(tf.lookup("map", "lidar", MIDDLE).is_ok());
    fixed(&mut tf, "30000", "0", at(0.1));
    let deep = tf.lookup("rest", "map", MIDDLE);
    assert_eq!(deep, Err(WhyNot::UnknownFrame("rest".into())));
    assert_eq!(tf.lookup("15000", "lidar", MIDDLE), Err(WhyNot::TooManyFrames("lidar".into())));
    assert_eq!(tf.ancestors("lidar")[..4], ["lidar", "base", "odom", "map"]);
}

#[test]
fn root_follows_repeated_transforms() {
    let mut tf = Transforms::default();
    moving(&mut tf, "world", "base", &[1, 2, 3], 0.3);
    fixed(&mut tf, "base", "lidar", at(0.2));
    assert_eq!(tf.root_of("/lidar"), "world");
    moving(&mut tf, "lidar", "world", &[2], 0.3);
    moving(&mut tf, "map", "world", &[2], 0.3);
    assert_eq!((tf.root_of("lidar"), tf.ancestors("lidar").len()), ("world".to_owned(), 3));
    fixed(&mut tf, "lidar", "world", at(0.3));
    assert_eq!(tf.root_of("lidar"), "world", "a loop does not change the root");
}

#[test]
fn second_parents_and_loops_are_reported() {
    let mut tf = robot();
    assert_eq!(tf.second_parent("base", "lidar"), None);
    let is_new = tf.insert("lidar", "map", 5, at(0.1), false);
    assert_eq!(is_new, Ok(true));
    assert_eq!(tf.insert("/lidar", "/map", 6, at(0.1), false), Ok(false));
    let found = tf.second_parent("lidar", "map").unwrap().to_string();
    assert_eq!(
        found,
        "frame map has the parent lidar, which closes a loop (map in lidar in base in odom in map)"
    );
    moving(&mut tf, "a\u{1b}[2J", "base", &[5], 0.1);
    let found = tf.second_parent("a\u{1b}[2J", "base").unwrap().to_string();
    assert_eq!(found, "frame base has two parents: odom and a\\u{1b}[2J");
}

#[test]
fn two_branches_meet_at_their_common_ancestor() {
    let mut tf = Transforms::default();
    fixed(&mut tf, "base", "left", RigidPose { position_m: [1.0, 0.0, 0.0], ..RigidPose::IDENTITY });
    fixed(&mut tf, "base", "right", RigidPose { position_m: [-1.0, 0.0, 0.0], ..RigidPose::IDENTITY });
    assert_eq!(tf.lookup("left", "right", 77).unwrap().position_m, [-2.0, 0.0, 0.0]);
}

#[test]
fn topic_samples_act_as_a_parent() {
    let mut tf = robot();
    let wanted = tf.lookup("map", "lidar", MIDDLE).unwrap();
    let samples = || {
        let mut samples = Samples::default();
        (0..=50).for_each(|tick| samples.insert(tick * S / 50, at(9.0)));
        samples
    };
    assert_eq!(tf.attach("/base", "base", samples()), Err(BadTransform::InItself("base".into())));
    assert_eq!(tf.attach("/", "base", samples()), Err(BadTransform::NoName));
    assert_eq!(tf.attach("empty", "base", Samples::default()), Ok(false));
    assert_eq!((tf.attach("/lidar", "/map", samples()), tf.parents_of("map")), (Ok(true), 1));
    assert_eq!(tf.lookup("map", "lidar", MIDDLE), Ok(wanted), "a loop changes no pose");
    assert_eq!(tf.second_parent("lidar", "map").unwrap().loop_frames, ["lidar", "base", "odom", "map"]);
    for parent in 0..100 {
        assert_eq!(tf.attach(&format!("p{parent}"), "base", samples()), Ok(true));
    }
    assert_eq!(
        (tf.parents_of("base"), tf.has_link("p98", "base"), tf.has_link("/p99", "/base")),
        (16, false, true)
    );
    assert_eq!(tf.lookup("map", "lidar", MIDDLE), Ok(wanted));
    assert_eq!(tf.attach("odom", "base", samples()), Ok(false));
    let found = tf.lookup("odom", "base", MIDDLE).unwrap();
    assert!((found.position_m[0] - 9.0).abs() < 1e-12, "{found:?}");
}

#[test]
fn unreadable_samples_are_always_an_error() {
    let cut = tempfile::NamedTempFile::new().unwrap();
    let mut samples = Samples::default();
    samples.file(PoseList::File(FilePart::open(cut.path(), 0, 6400).unwrap()));
    let mut tf = robot();
    fixed(&mut tf, "odom", "base", at(2.0));
    assert_eq!(tf.attach("elsewhere", "base", samples), Ok(true));
    for (target, source) in [("map", "lidar"), ("lidar", "map"), ("nowhere", "lidar")] {
        let found = tf.lookup(target, source, MIDDLE);
        assert!(matches!(found, Err(WhyNot::Unreadable(_))), "{target}: {found:?}");
    }
    assert_eq!(tf.ancestors("lidar").len(), 5);
}

#[test]
fn single_transforms_are_used_if_nothing_else_moves() {
    let mut tf = Transforms::default();
    fixed(&mut tf, "base", "lidar", at(0.2));
    moving(&mut tf, "odom", "base", &[5 * S], 0.3);
    assert_eq!(tf.ancestors("lidar"), ["lidar", "base", "odom"]);
    assert_eq!((tf.root_of("lidar"), tf.root_of("base")), ("odom".to_owned(), "odom".to_owned()));
    assert_eq!(tf.lookup("odom", "base", 5 * S), Ok(at(0.3)));
    assert_eq!(tf.lookup("odom", "lidar", 4 * S), Err(WhyNot::Before("base".into())));
    assert_eq!(tf.lookup("odom", "lidar", 6 * S), Err(WhyNot::After("base".into())));
}

#[test]
fn frames_unrelated_to_the_map_are_not_searched() {
    let mut tf = robot();
    let wanted = tf.lookup("map", "lidar", MIDDLE).unwrap();
    // Chains above the sensor and above the map; one of them leads back.
    for frame in 0..3000 {
        fixed(&mut tf, &format!("a{}", frame + 1), &format!("a{frame}"), RigidPose::IDENTITY);
        fixed(&mut tf, &format!("b{}", frame + 1), &format!("b{frame}"), RigidPose::IDENTITY);
    }
    fixed(&mut tf, "a0", "base", at(3.0));
    fixed(&mut tf, "b0", "map", at(3.0));
    fixed(&mut tf, "lidar", "b3000", at(3.0));
    let between = tf.frames_between("/map", "/lidar").unwrap();
    let mut names: Vec<&str> = between.iter().map(String::as_str).collect();
    names.sort_unstable();
    assert_eq!(names, ["base", "lidar", "map", "odom"]);
    let among = tf.search_frames("map", "lidar").unwrap();
    assert!(among.above.is_none());
    assert_eq!(tf.lookup_among("map", "lidar", MIDDLE, Some(&among)), Ok(wanted));
    assert_eq!(tf.frames_between("a2000", "lidar"), Err(WhyNot::TooManyFrames("lidar".into())));
    // The sensor above the map, and both below another frame.
    for (target, source) in [("lidar", "map"), ("side", "lidar")] {
        fixed(&mut tf, "base", "side", at(1.0));
        tf.detach("b3000");
        tf.detach("a0");
        tf.detach("b0");
        let among = tf.search_frames(target, source).unwrap();
        let found = tf.lookup_among(target, source, MIDDLE, Some(&among));
        assert_eq!((found.is_ok(), found), (true, tf.lookup(target, source, MIDDLE)));
    }
}

/// An upward path at one time must not hide a common ancestor at other times.
#[test]
fn a_common_ancestor_gives_poses_before_the_map_frame_is_a_parent() {
    let mut tf = Transforms::default();
    fixed(&mut tf, "base", "lidar", at(0.2));
    fixed(&mut tf, "world", "map", at(5.0));
    let moves: Vec<i64> = (0..=60).map(|k| k * S).collect();
    moving(&mut tf, "world", "base", &moves, 1.0);
    let wanted = tf.lookup("map", "lidar", 30 * S).unwrap();
    for stamps in [vec![30 * S], vec![61 * S, 62 * S, 63 * S]] {
        let mut tf = tf.clone();
        moving(&mut tf, "map", "base", &stamps, 2.0);
        let among = tf.search_frames("map", "lidar").unwrap();
        assert!(!among.between.contains("world"));
        for stamp_ns in [S, 30 * S, 59 * S + 7] {
            let found = tf.lookup_among("map", "lidar", stamp_ns, Some(&among));
            assert_eq!(
                (found.clone(), found),
                (Ok(wanted), tf.lookup("map", "lidar", stamp_ns)),
                "{stamps:?}"
            );
        }
        let found = tf.lookup_among("map", "lidar", 62 * S, Some(&among));
        assert_eq!(found.is_ok(), stamps.len() > 1, "{found:?}");
        assert_eq!(found, tf.lookup("map", "lidar", 62 * S));
    }
}

/// The search must stop at the target frame.
#[test]
fn loops_above_the_map_frame_are_no_error() {
    let wanted = robot().lookup("map", "lidar", MIDDLE).unwrap();
    let links: [&[(&str, &str)]; 4] = [
        &[("world", "map"), ("map", "world")],
        &[("a", "map"), ("b", "a"), ("c", "b"), ("a", "c")],
        &[("base", "map")],
        &[("map", "odom"), ("odom", "map")],
    ];
    for links in links {
        for is_static in [true, false] {
            let mut tf = robot();
            for (parent, child) in links.iter().filter(|link| **link != ("map", "odom")) {
                tf.insert(parent, child, MIDDLE, at(4.0), is_static).unwrap();
            }
            assert_eq!(tf.lookup("map", "lidar", MIDDLE), Ok(wanted), "{links:?}");
            let between = tf.links_between("map", "lidar", MIDDLE).unwrap();
            assert_eq!(between, [vec![], vec!["lidar".to_owned(), "base".to_owned(), "odom".to_owned()]]);
            assert!(tf.frames_between("map", "lidar").unwrap().contains("odom"));
        }
    }
}
