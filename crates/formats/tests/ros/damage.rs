use crate::support::{Cloud, FILES, assert_clouds, data, read, topic};
use std::slice::from_ref;
use voxtile_formats::CloudSource;
use voxtile_formats::ros::{BagOptions, PoseSource, open_bag, open_recording};

#[test]
fn truncated_files_give_complete_messages() {
    let folder = tempfile::tempdir().unwrap();
    for name in FILES {
        let bytes = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name);
        // Without the last byte the index is lost, but no message.
        std::fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
        let (clouds, errors, remarks) = read(from_ref(&path), &topic("/points"));
        assert_eq!(errors, Vec::<String>::new(), "{name}");
        assert_eq!(remarks.len(), 1, "{name}: {remarks:?}");
        assert!(remarks[0].contains("41 messages were found"), "{remarks:?}");
        assert_clouds(&clouds, "map", name);
        // Cut within the messages: some are lost, but not the first.
        std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
        let (clouds, _, remarks) = read(&[path], &topic("/points"));
        assert!((1..4).contains(&clouds.len()), "{name}: {}", clouds.len());
        assert!(remarks.iter().any(|remark| remark.contains("truncated")), "{name}: {remarks:?}");
    }
}

#[cfg(feature = "sqlite")]
#[test]
fn folders_with_truncated_or_missing_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    let copy = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    copy("metadata.yaml", &std::fs::read(data("by_file/metadata.yaml")).unwrap());
    let error = format!("{:#}", open_recording(&[folder.path().to_owned()]).err().unwrap());
    assert!(error.contains("lists by_file.db3.zstd, which does not exist"), "{error}");
    let bytes = std::fs::read(data("by_file/by_file.db3.zstd")).unwrap();
    copy("by_file.db3.zstd", &bytes[..bytes.len() - 1]);
    // The archive is a single block: without its end, nothing can be decompressed.
    let error = format!("{:#}", open_recording(&[folder.path().to_owned()]).err().unwrap());
    assert!(error.contains("by_file.db3.zstd: malformed: offset 0: it is truncated or damaged"), "{error}");
    // Without metadata, files are found by their names.
    std::fs::remove_file(folder.path().join("metadata.yaml")).unwrap();
    copy("by_file.db3.zstd", &bytes);
    let (clouds, errors, remarks) = read(&[folder.path().to_owned()], &topic("/points"));
    assert_eq!((errors, remarks.len()), (vec![], 1), "{remarks:?}");
    assert_clouds(&clouds, "map", "without metadata");
}

#[test]
fn foreign_files_are_errors() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["x.bag", "x.mcap", "x.db3", "x.txt"] {
        let path = folder.path().join(name);
        for bytes in [&b""[..], b"#ROSBAG V1.2\n", b"hello"] {
            std::fs::write(&path, bytes).unwrap();
            let error = open_recording(from_ref(&path)).err().map(|error| format!("{error:#}"));
            assert!(error.is_some_and(|error| error.contains(name)), "{name}");
        }
    }
    assert!(open_recording(&[folder.path().join("gone.bag")]).is_err());
    let empty = tempfile::tempdir().unwrap();
    assert!(open_recording(&[empty.path().to_owned()]).is_err());
    assert!(open_recording(&[]).is_err());
}

/// Simple pseudo-random number generator.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

#[test]
fn damaged_files_do_not_panic_or_hang() {
    let folder = tempfile::tempdir().unwrap();
    let mut numbers = Numbers(3);
    let databases = cfg!(feature = "sqlite").then_some("folder/folder.db3");
    for name in FILES.into_iter().chain(databases) {
        let whole = std::fs::read(data(name)).unwrap();
        let path = folder.path().join(name.rsplit('/').next().unwrap());
        let mut read = 0;
        for turn in 0..250 {
            let mut bytes = whole.clone();
            if turn % 3 != 0 {
                for _ in 0..=numbers.below(8) {
                    let at = numbers.below(bytes.len());
                    bytes[at] = [0, 255, 127, 1, numbers.below(256) as u8][numbers.below(5)];
                }
            }
            if turn % 3 != 1 {
                bytes.truncate(numbers.below(bytes.len()));
            }
            std::fs::write(&path, &bytes).unwrap();
            for (topic_name, poses) in [("/points", PoseSource::Tf), ("/livox", PoseSource::Odometry)] {
                let options = BagOptions { poses, ..topic(topic_name) };
                let Ok(mut source) = open_bag(from_ref(&path), &options) else { continue };
                let mut calls = 0;
                while !matches!(source.next_cloud(), Ok(None)) {
                    let _ = source.read_points(&mut |_| {
                        read += 1;
                        Ok(())
                    });
                    calls += 1;
                    assert!(calls < 10_000, "{name}, turn {turn}: it does not end");
                }
            }
        }
        // Ensures that many points were decoded despite the damage.
        assert!(read > 2_000, "{name}: {read} points");
    }
}

/// Returns the offsets of the checksums of an MCAP file's chunks.
fn checksums(file: &[u8]) -> Vec<usize> {
    let (mut at, mut found) = (8, Vec::new());
    while let Some(length) = file.get(at + 1..at + 9) {
        if file[at] == 6 {
            found.push(at + 9 + 24);
        }
        at += 9 + u64::from_le_bytes(length.try_into().unwrap()) as usize;
    }
    found
}

#[test]
fn mcap_chunks_with_wrong_checksum_are_damaged() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let (mut checked, mut left_out) = (0, 0);
    for name in ["none.mcap", "lz4.mcap", "zstd.mcap", "ros1.mcap"] {
        let whole = std::fs::read(data(name)).unwrap();
        let (wanted, _, _) = read(&[data(name)], &topic("/points"));
        for at in checksums(&whole) {
            let has_checksum = whole[at..at + 4] != [0; 4];
            for (bytes, is_damaged) in [([1, 2, 3, 4], true), ([0; 4], false)] {
                let mut file = whole.clone();
                file[at..at + 4].copy_from_slice(&bytes);
                std::fs::write(&path, file).unwrap();
                let (clouds, mut errors, remarks) = read(from_ref(&path), &topic("/points"));
                // No cloud is read from damaged bytes, and each missing cloud has an error.
                assert_eq!(clouds.len() + errors.len(), 4, "{name}: {errors:?}");
                assert_same(&clouds, &wanted, true);
                left_out += errors.len();
                errors.extend(remarks);
                assert_eq!(!errors.is_empty(), is_damaged, "{name}: {errors:?}");
                // Clouds may also lose their poses.
                let damages: Vec<_> = errors.iter().filter(|error| error.contains("damaged")).collect();
                assert_eq!(!damages.is_empty(), is_damaged, "{name}: {errors:?}");
                let is_named = damages.iter().all(|error| error.contains("but its header states 04030201"));
                assert!(is_named, "{name}: {errors:?}");
            }
            checked += usize::from(has_checksum);
        }
    }
    assert!(checked > 0 && left_out >= 4, "the fixtures have checksums: {checked} {left_out}");
}

/// Damaged chunks are also skipped in a file without an index.
#[test]
fn damaged_chunks_without_index_are_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let whole = std::fs::read(data("zstd.mcap")).unwrap();
    let (wanted, _, _) = read(&[data("zstd.mcap")], &topic("/points"));
    for at in checksums(&whole) {
        let mut file = whole[..whole.len() - 1].to_vec();
        file[at] ^= 1;
        std::fs::write(&path, file).unwrap();
        let (clouds, errors, _) = read(from_ref(&path), &topic("/points"));
        // Without an index, a damaged chunk without clouds is also an error, because it could contain clouds.
        let all = clouds.len() + errors.len();
        assert!(!errors.is_empty() && (4..=5).contains(&all), "{}: {errors:?}", clouds.len());
        assert_same(&clouds, &wanted, all == 4);
    }
}

/// Checks that clouds equal those of the whole file with the same stamps and, optionally, names.
fn assert_same(clouds: &[Cloud], whole: &[Cloud], have_names: bool) {
    for (head, points) in clouds {
        let (same, wanted) = whole.iter().find(|(same, _)| same.stamp_ns == head.stamp_ns).unwrap();
        assert_eq!(format!("{points:?}"), format!("{wanted:?}"));
        assert!(!have_names || head.name == same.name, "{} is {}", head.name, same.name);
    }
}

/// If all clouds are damaged, their number is still known, and each is reported as an error.
#[test]
fn damage_without_index_and_clouds_is_reported() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let mut file = std::fs::read(data("only_points.mcap")).unwrap();
    let (clouds, _, _) = read(&[data("only_points.mcap")], &BagOptions::default());
    file.pop();
    let places = checksums(&file);
    assert!(!places.is_empty() && !clouds.is_empty());
    for at in places {
        file[at..at + 4].copy_from_slice(&[1, 2, 3, 4]);
    }
    std::fs::write(&path, file).unwrap();
    let source = open_bag(from_ref(&path), &BagOptions::default()).unwrap();
    assert_eq!(source.len_hint(), Some(clouds.len() as u64));
    let (found, errors, _) = read(&[path], &BagOptions::default());
    assert_eq!((found.len(), errors.len()), (0, clouds.len()), "{errors:?}");
    assert!(errors.iter().all(|error| error.contains("a chunk is damaged")), "{errors:?}");
}

/// Each cloud must equal an original one, whatever the decoder outputs before it fails.
#[test]
fn no_cloud_is_read_from_damaged_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.bag");
    let text = |name: &std::path::Path| {
        let (clouds, errors, _) =
            read(&[name.to_owned()], &BagOptions { poses: PoseSource::None, ..topic("/points") });
        let texts: Vec<String> = clouds.iter().map(|(_, points)| format!("{points:?}")).collect();
        (texts, errors)
    };
    let (wanted, _) = text(&data("bz2.bag"));
    let whole = std::fs::read(data("bz2.bag")).unwrap();
    let start = whole.windows(3).position(|bytes| bytes == b"BZh").unwrap();
    let mut damaged = 0;
    for at in (start + 40..start + 1400).step_by(170) {
        let mut file = whole.clone();
        file[at] ^= 0x10;
        std::fs::write(&path, file).unwrap();
        let (found, errors) = text(&path);
        assert!(found.iter().all(|cloud| wanted.contains(cloud)), "byte {at}: {errors:?}");
        damaged += usize::from(!errors.is_empty());
    }
    assert!(damaged > 4, "{damaged}");
}
