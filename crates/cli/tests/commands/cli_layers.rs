use crate::cli::{failure, json, output, text};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const EDGE_M: f64 = 0.5;
const ALL: &str = "colour,intensity,class,time,shape";

type Voxel = [i64; 3];

/// Writes two coloured clouds of a floor and a wall and their poses; returns the folder.
fn clouds(folder: &TempDir) -> PathBuf {
    let clouds = folder.path().join("clouds");
    fs::create_dir(&clouds).unwrap();
    for number in 0..2 {
        let mut rows = String::new();
        let mut count = 0;
        for k in 0..900 {
            // Two to three points in most voxels, at exact binary fractions.
            let (a, b) = (f64::from(k % 30) * 0.375, f64::from(k / 30) * 0.3125);
            let [x, y, z] = if k % 3 == 0 { [a - 5.0, b - 4.0, -1.375] } else { [6.125, a - 5.0, b - 1.0] };
            let [red, green, blue] = [(k / 4 * 4) % 256, (7 * number + k) % 256, 200];
            rows += &format!("{x} {y} {z} {red} {green} {blue} {} {}\n", k % 256, k % 5);
            count += 1;
        }
        let head = format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float x\nproperty float y\nproperty float \
             z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty float intensity\nproperty \
             uchar class\nend_header\n"
        );
        fs::write(clouds.join(format!("170000000{number}.500000.ply")), head + &rows).unwrap();
    }
    let poses = "1700000000.5 0 0 0 0 0 0 1\n1700000001.5 0.125 0 0 0 0 0 1\n";
    fs::write(clouds.join("poses_tum.txt"), poses).unwrap();
    clouds
}

/// Builds a map of the clouds with these layers.
fn map_of(folder: &TempDir, name: &str, layers: &str) -> String {
    let clouds = folder.path().join("clouds");
    let clouds = if clouds.exists() { clouds } else { self::clouds(folder) };
    let (map, resolution) = (text(&folder.path().join(name)).to_owned(), EDGE_M.to_string());
    let layers = ["--resolution", &resolution, "--keep-scans", "--layers", layers];
    output(&[&["build", text(&clouds), "-o", &map][..], &layers].concat());
    map
}

/// Exports a map; returns the file.
fn exported(map: &str, file: &Path, options: &[&str]) -> PathBuf {
    output(&[&["export", map, "-o", text(file)], options].concat());
    file.to_owned()
}

/// Returns the cells of a CSV file by voxel and column.
fn table(file: &Path) -> BTreeMap<Voxel, BTreeMap<String, String>> {
    let text = fs::read_to_string(file).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    lines
        .map(|line| {
            let row: BTreeMap<String, String> = names
                .iter()
                .zip(line.split(','))
                .map(|(name, cell)| (name.to_string(), cell.to_owned()))
                .collect();
            let index = ["x", "y", "z"].map(|k| (row[k].parse::<f64>().unwrap() / EDGE_M).floor() as i64);
            (index, row)
        })
        .collect()
}

/// Returns the columns of a table, numbers rounded to single precision.
fn columns(table: &BTreeMap<Voxel, BTreeMap<String, String>>, names: &[&str]) -> Vec<(Voxel, Vec<f32>)> {
    let cells =
        |row: &BTreeMap<String, String>| names.iter().map(|name| row[*name].parse().unwrap()).collect();
    table.iter().map(|(index, row)| (*index, cells(row))).collect()
}

#[test]
fn exported_points_can_be_mapped_with_their_layers() {
    let folder = TempDir::new().unwrap();
    let map = map_of(&folder, "map", ALL);
    let expected = table(&exported(&map, &folder.path().join("a.csv"), &[]));
    assert!(expected.len() > 150);
    let colours = ["red", "green", "blue"];
    let with_class = ["red", "green", "blue", "intensity", "class"];
    let formats: [(&str, &[&str]); 6] = [
        ("ply", &with_class),
        ("pcd", &with_class),
        ("csv", &with_class),
        // Recordings have the class as a field, too.
        #[cfg(feature = "ros")]
        ("mcap", &with_class),
        #[cfg(feature = "e57")]
        ("e57", &with_class[..4]),
        // Intensities of LAS are shares of the largest one.
        #[cfg(feature = "las")]
        ("laz", &colours),
    ];
    for (extension, names) in formats {
        let file = exported(&map, &folder.path().join(format!("b.{extension}")), &[]);
        let again = folder.path().join(format!("of_{extension}"));
        let options = ["--no-rays", "--resolution", "0.5", "--layers", "colour,intensity,class"];
        output(&[&["build", text(&file), "-o", text(&again)][..], &options].concat());
        let found = table(&exported(text(&again), &folder.path().join("again.csv"), &[]));
        let round = |rows: Vec<(Voxel, Vec<f32>)>| -> Vec<(Voxel, Vec<i64>)> {
            // Intensities are stored in steps of 255 / 65535.
            rows.into_iter()
                .map(|(at, row)| (at, row.iter().map(|x| (x * 100.0).round() as i64).collect()))
                .collect()
        };
        let (found, expected) = (round(columns(&found, names)), round(columns(&expected, names)));
        assert_eq!(found.len(), expected.len(), "{extension}");
        for ((at, found), (index, expected)) in found.iter().zip(&expected) {
            assert_eq!(at, index, "{extension}");
            assert!(
                found.iter().zip(expected).all(|(a, b)| (a - b).abs() <= 1),
                "{extension} {at:?} {found:?}"
            );
        }
    }
}

#[test]
fn octree_files_have_colours_unless_they_are_left_out() {
    let folder = TempDir::new().unwrap();
    let (map, plain) = (map_of(&folder, "map", "colour"), map_of(&folder, "plain", "none"));
    let file = |map: &str, name: &str, options: &[&str]| {
        fs::read(exported(map, &folder.path().join(name), options)).unwrap()
    };
    let coloured = file(&map, "a.ot", &[]);
    assert!(coloured.windows(14).any(|part| part == b"id ColorOcTree"));
    let without = file(&plain, "b.ot", &[]);
    assert!(without.windows(10).any(|part| part == b"id OcTree\n"));
    assert!(file(&map, "c.ot", &["--no-layers"]) == without);
    assert!(file(&map, "d.bt", &[]) == file(&plain, "e.bt", &[]));
    assert!(file(&map, "f.csv", &["--no-layers"]) == file(&plain, "g.csv", &[]));
    assert!(file(&map, "h.glb", &["--no-layers"]) == file(&plain, "i.glb", &[]));
    assert!(file(&map, "j.glb", &[]) != file(&plain, "k.glb", &[]));
    // The same log-odds are read from it.
    let read = |name: &str| output(&["digest", text(&folder.path().join(name))]);
    assert_eq!(read("a.ot"), read("b.ot"));
}

#[test]
fn mean_points_are_those_of_the_clouds() {
    let folder = TempDir::new().unwrap();
    let map = map_of(&folder, "map", "shape");
    let centers = table(&exported(&map, &folder.path().join("centers.csv"), &[]));
    let means = table(&exported(&map, &folder.path().join("means.csv"), &["--mean-points"]));
    assert!(centers.keys().eq(means.keys()));
    let mut sums: BTreeMap<Voxel, (f64, [f64; 3])> = BTreeMap::new();
    for number in 0..2 {
        let cloud = folder.path().join(format!("clouds/170000000{number}.500000.ply"));
        for row in fs::read_to_string(cloud).unwrap().lines().skip_while(|line| *line != "end_header").skip(1)
        {
            let numbers: Vec<f64> = row.split(' ').map(|word| word.parse().unwrap()).collect();
            let point = [numbers[0] + 0.125 * f64::from(number), numbers[1], numbers[2]];
            let (count, sum) = sums.entry(point.map(|x| (x / EDGE_M).floor() as i64)).or_default();
            *count += 1.0;
            (0..3).for_each(|k| sum[k] += point[k]);
        }
    }
    for (voxel, row) in &means {
        let (count, sum) = sums[voxel];
        for (k, name) in ["x", "y", "z"].into_iter().enumerate() {
            let off_m = row[name].parse::<f64>().unwrap() - sum[k] / count;
            // Offsets are rounded down to a 1024th of the edge, which the mean adds half of.
            assert!(off_m.abs() <= EDGE_M / 2048.0 + 1e-12, "{voxel:?} {name} {off_m}");
        }
    }
    // Regions select voxels by their centers, and voxels without a hit remain at theirs.
    let region = ["--region", "-3", "-3", "-2", "1", "2", "2"];
    let file = folder.path().join("part.csv");
    let part = table(&exported(&map, &file, &[&region[..], &["--mean-points", "--what", "all"]].concat()));
    let expected = table(&exported(&map, &file, &[&region[..], &["--what", "all"]].concat()));
    assert!(part.keys().eq(expected.keys()) && part.len() > 100);
    for (voxel, row) in part.iter().filter(|(voxel, _)| !sums.contains_key(*voxel)) {
        assert_eq!(row["x"], expected[voxel]["x"]);
    }
}

#[test]
fn mean_points_need_the_layer_and_a_format_of_points() {
    let folder = TempDir::new().unwrap();
    let map = map_of(&folder, "map", "colour");
    let refused = |name: &str| {
        let (code, message) =
            failure(&["export", &map, "-o", text(&folder.path().join(name)), "--mean-points"]);
        assert_eq!(code, 2, "{message}");
        assert!(message.contains("--mean-points"), "{message}");
        message
    };
    for name in ["a.csv", "a.npz"] {
        assert!(refused(name).contains("-o NEW --layers shape"));
    }
    assert!(refused("a.glb").contains("glb does not support it"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn remap_gives_another_map_the_layers_that_its_scans_hold() {
    let folder = TempDir::new().unwrap();
    let plain = map_of(&folder, "plain", "colour,class");
    let new = text(&folder.path().join("new")).to_owned();
    let made = json(&["remap", &plain, "-o", &new, "--layers", ALL, "--json"]);
    assert_eq!(made["scans_without"]["colour"], 0);
    let layers = |map: &str| output(&["digest", map, "--layers"]);
    assert_eq!(layers(&new), layers(&map_of(&folder, "all", ALL)));
    // A map without layers keeps no colours.
    let bare = map_of(&folder, "bare", "none");
    let other = text(&folder.path().join("other")).to_owned();
    let (code, message) = failure(&["remap", &bare, "-o", &other, "--layers", ALL]);
    assert_eq!(code, 2, "{message}");
    assert!(message.contains("nothing for colour, class:"), "{message}");
    output(&["remap", &bare, "-o", &other, "--layers", "shape,time,intensity"]);
    exported(&other, &folder.path().join("means.csv"), &["--mean-points"]);
    // Other commands refuse layers for a map without.
    let clouds = folder.path().join("clouds");
    let (code, message) = failure(&["build", text(&clouds), "-o", &bare, "--append", "--layers", "shape"]);
    assert_eq!(code, 2, "{message}");
    assert!(message.contains("remap MAP -o NEW") && message.contains("--layers"), "{message}");
}
