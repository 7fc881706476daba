use crate::attributes::{BOTH, Row, options, scanned};
use crate::made::las::{Las, Packing};
use crate::support::shared_data;
use std::fs;
use voxtile_formats::{ClassSelection, ReadOptions, Returns};

/// Enough points for several chunks, and for many records beyond a tiny budget.
const POINTS: usize = 20_000;

/// Larger files take too long for a test.
const MAX_POINTS: u64 = 400_000;

fn colour(k: usize) -> [u16; 3] {
    [k as u16 | 0x100, (k as u16).wrapping_mul(77), 60_000]
}

fn bytes(k: usize) -> [u16; 3] {
    [(k % 256) as u16, 3, 255]
}

fn class(k: usize) -> u8 {
    (k.wrapping_mul(2_654_435_761) >> 7) as u8 % 19
}

fn returns(k: usize) -> [u8; 2] {
    let count = (k % 4) as u8;
    [((k / 4) % 5) as u8 % (count + 1), count]
}

fn las(format: u8) -> Las {
    let minor = if format < 6 { 3 } else { 4 };
    Las { colour, class, returns, ..Las::new(minor, format, POINTS) }
}

fn wanted(las: &Las, of: impl Fn([u16; 3]) -> Option<[u8; 3]>) -> Vec<Row> {
    (0..las.points).map(|k| (las.place(k), of((las.colour)(k)), Some((las.class)(k)))).collect()
}

#[test]
fn las_files_give_colours_and_classes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    for format in [0, 1, 2, 3, 5, 6, 7, 8, 10] {
        let las = las(format);
        let is_coloured = ![0, 1, 6].contains(&format);
        let wide = |colour: [u16; 3]| is_coloured.then(|| colour.map(|value| (value >> 8) as u8));
        let rows = wanted(&las, wide);
        let mut files = vec![las.bytes()];
        if format < 6 && format != 5 {
            files.push(las.packed(Packing::PointWise));
        }
        if ![5, 10].contains(&format) {
            files.push(las.packed(Packing::Chunked(700)));
        }
        for bytes in files {
            fs::write(&path, bytes).unwrap();
            for (memory_bytes, scan_period_s) in [(1 << 14, 0.0), (1 << 14, 1.5), (1 << 28, 1.5)] {
                let reading = ReadOptions { memory_bytes, scan_period_s, ..options(BOTH) };
                let (found, remarks) = scanned(&path, &reading, 0).unwrap();
                assert!(found == rows, "{format} {memory_bytes} {scan_period_s}");
                assert_eq!(remarks, [""; 0]);
            }
        }
    }
}

/// Points are sorted by time, in memory or in a file. Their attributes move with them.
#[test]
fn order_of_records_does_not_matter() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    for (format, of_point) in [(3, colour as fn(usize) -> [u16; 3]), (7, bytes)] {
        let las = Las { colour: of_point, ..las(format) };
        let mut records: Vec<Vec<u8>> = (0..POINTS).map(|k| las.point(k)).collect();
        for k in (1..POINTS).rev() {
            records.swap(k, k.wrapping_mul(2_654_435_761) % (k + 1));
        }
        fs::write(&path, [las.head(false), records.concat()].concat()).unwrap();
        let low = |colour: [u16; 3]| Some(colour.map(|value| value as u8));
        let high = |colour: [u16; 3]| Some(colour.map(|value| (value >> 8) as u8));
        let rows = if format == 3 { wanted(&las, high) } else { wanted(&las, low) };
        for memory_bytes in [1 << 12, 1 << 16, 1 << 28] {
            let reading = ReadOptions { memory_bytes, scan_period_s: 0.9, ..options(BOTH) };
            assert!(scanned(&path, &reading, 0).unwrap().0 == rows, "{format} {memory_bytes}");
        }
    }
}

#[test]
fn scale_of_colours_is_that_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    let low = |colour: [u16; 3]| Some(colour.map(|value| value as u8));
    let late = |k: usize| if k == POINTS - 1 { [256; 3] } else { bytes(k) };
    let high = |colour: [u16; 3]| Some(colour.map(|value| (value >> 8) as u8));
    for format in [2, 3, 7] {
        for scan_period_s in [0.0, 1.5] {
            let reading = ReadOptions { memory_bytes: 1 << 14, scan_period_s, ..options(BOTH) };
            let las = Las { colour: bytes, ..las(format) };
            for bytes in [las.bytes(), las.packed(Packing::Chunked(999))] {
                fs::write(&path, bytes).unwrap();
                let (found, remarks) = scanned(&path, &reading, 0).unwrap();
                assert!(found == wanted(&las, low) && remarks.len() == 1, "{format}");
                assert!(remarks[0].contains("numbers from 0 to 255"), "{remarks:?}");
            }
            // One point with 16 bits decides for all, even if it is left out.
            let las = Las { colour: late, ..las };
            fs::write(&path, las.bytes()).unwrap();
            let (found, remarks) = scanned(&path, &reading, 0).unwrap();
            assert!(found == wanted(&las, high) && remarks.is_empty(), "{format} {remarks:?}");
            let classes = ClassSelection { skip_class: vec![class(POINTS - 1)], ..ClassSelection::default() };
            let found = scanned(&path, &ReadOptions { classes, ..reading.clone() }, 0).unwrap().0;
            assert!(found.iter().all(|row| row.1.is_some_and(|colour| colour[0] < 2)));
            let las = Las { colour: |_| [0; 3], ..las };
            fs::write(&path, las.bytes()).unwrap();
            let (found, remarks) = scanned(&path, &reading, 0).unwrap();
            assert!(found == wanted(&las, |_| None) && remarks[0].contains("are black"), "{remarks:?}");
        }
    }
}

#[test]
fn las_points_are_selected_by_class_and_return() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.las");
    for format in [1, 3, 6, 7] {
        let las = las(format);
        fs::write(&path, las.bytes()).unwrap();
        for (only_class, skip_class) in [(vec![], vec![]), (vec![2, 5, 6], vec![]), (vec![], vec![7, 18])] {
            for selected in [Returns::All, Returns::First, Returns::Last] {
                let classes =
                    ClassSelection { only_class: only_class.clone(), skip_class: skip_class.clone() };
                let is_selected = |k: &usize| {
                    let [number, count] = returns(*k);
                    classes.takes(Some(class(*k))) && selected.takes(number, count)
                };
                let rows: Vec<[f64; 3]> = (0..POINTS).filter(is_selected).map(|k| las.place(k)).collect();
                for (memory_bytes, scan_period_s) in [(1 << 14, 0.0), (1 << 14, 0.7), (1 << 28, 0.7)] {
                    let reading = ReadOptions {
                        classes: classes.clone(),
                        returns: selected,
                        memory_bytes,
                        scan_period_s,
                        ..options(Default::default())
                    };
                    let (found, remarks) = scanned(&path, &reading, 0).unwrap();
                    assert!(found.iter().map(|row| row.0).eq(rows.iter().copied()), "{format} {selected:?}");
                    let counted: usize = remarks
                        .iter()
                        .filter(|remark| remark.contains("left out by their"))
                        .map(|remark| remark.split(' ').next().unwrap().parse::<usize>().unwrap())
                        .sum();
                    assert_eq!(counted, POINTS - rows.len(), "{remarks:?}");
                }
            }
        }
    }
}

/// Real files, compared with the crate `las`.
#[test]
fn real_files_have_the_attributes_that_another_reader_finds() {
    let Some(folder) = shared_data("las_large_coords") else { return };
    let (mut files, mut coloured) = (0, 0);
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if !path.extension().is_some_and(|extension| extension == "las" || extension == "laz") {
            continue;
        }
        let Ok(mut reader) = las::Reader::from_path(&path) else { continue };
        let Ok(data) = reader.read_points(MAX_POINTS) else { continue };
        let Ok(points) = data.points().collect::<Result<Vec<las::Point>, _>>() else { continue };
        if points.len() as u64 == MAX_POINTS {
            continue;
        }
        let color = |point: &las::Point| point.color.map(|color| [color.red, color.green, color.blue]);
        let largest = points.iter().filter_map(color).flatten().max().unwrap_or(0);
        let shift = if largest > 255 { 8 } else { 0 };
        let wanted = points.iter().filter(|point| !point.is_withheld).map(|point| {
            let colour = color(point).filter(|_| largest > 0);
            let class = u8::from(point.classification);
            (colour.map(|colour| colour.map(|value| (value >> shift) as u8)), Some(class))
        });
        let reading = ReadOptions { scan_period_s: 0.0, ..options(BOTH) };
        let (found, _) = scanned(&path, &reading, 0).unwrap();
        assert!(found.iter().map(|row| (row.1, row.2)).eq(wanted), "{}", path.display());
        files += 1;
        coloured += usize::from(largest > 0);
    }
    assert!(files > 2 && coloured > 0, "{files} {coloured}");
}
