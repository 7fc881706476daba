use crate::cli::{failure, json, output, text};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
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
    // Poses are looked for in the folder above, too.
    let files = folder.path().join("files");
    fs::create_dir(&files).unwrap();
    for (extension, names) in formats {
        let file = exported(&map, &files.join(format!("b.{extension}")), &[]);
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

/// Converts linear light to a channel of an sRGB colour.
fn srgb_of(linear: u16) -> u8 {
    let share = f64::from(linear) / 65_535.0;
    let channel = if share <= 0.003_130_8 { 12.92 * share } else { 1.055 * share.powf(1.0 / 2.4) - 0.055 };
    (255.0 * channel).round() as u8
}

/// Returns the colours of the faces of a mesh of 3D Tiles, by voxel of the node.
fn face_colours(mesh: &Path) -> BTreeSet<(Voxel, [u8; 3])> {
    let bytes = fs::read(mesh).unwrap();
    let head_bytes = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
    let head: Value = serde_json::from_slice(&bytes[20..20 + head_bytes]).unwrap();
    let (colour, views) = (&head["accessors"][1], &head["bufferViews"]);
    assert_eq!((&colour["componentType"], &colour["normalized"]), (&5123.into(), &true.into()));
    let number = |value: &Value| value.as_u64().unwrap() as usize;
    let (stride, colour_at) = (number(&views[0]["byteStride"]), number(&colour["byteOffset"]));
    let node = &head["nodes"][0];
    let [x, y, z] = [0, 1, 2].map(|k| node["translation"][k].as_f64().unwrap());
    let edge_m = node["scale"][0].as_f64().unwrap();
    let binary = &bytes[20 + head_bytes + 8..];
    let vertices = binary[..stride * number(&colour["count"])].chunks_exact(stride).map(|vertex| {
        let short = |at: usize| u16::from_le_bytes([vertex[at], vertex[at + 1]]);
        let along = |k: usize, from_m: f64| (from_m / edge_m).round() as i64 + i64::from(short(2 * k));
        let [red, green, blue, alpha] = [0, 1, 2, 3].map(|k| short(colour_at + 2 * k));
        assert_eq!(alpha, u16::MAX);
        // glTF has y up: y of the map is -z.
        ([along(0, x), -along(2, z), along(1, y)], [red, green, blue].map(srgb_of))
    });
    let mut faces = BTreeSet::new();
    for quad in vertices.collect::<Vec<_>>().chunks_exact(4) {
        let (a, b, c) = (quad[0].0, quad[1].0, quad[2].0);
        assert!(quad.iter().all(|(_, colour)| *colour == quad[0].1), "{quad:?}");
        let (u, v): (Voxel, Voxel) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - b[k]));
        // The cells of the face are inside, so below its upper side.
        let [xs, ys, zs] = [0, 1, 2].map(|k| {
            let (next, last) = ((k + 1) % 3, (k + 2) % 3);
            match u[next] * v[last] - u[last] * v[next] {
                0 => a[k].min(c[k])..a[k].max(c[k]),
                normal => a[k] - i64::from(normal > 0)..a[k] + i64::from(normal < 0),
            }
        });
        for (x, y) in xs.flat_map(|x| ys.clone().map(move |y| (x, y))) {
            faces.extend(zs.clone().map(|z| ([x, y, z], quad[0].1)));
        }
    }
    faces
}

#[test]
fn meshes_of_3d_tiles_have_mean_colours_at_every_level() {
    const TILE_EDGE: i64 = 16;
    let folder = TempDir::new().unwrap();
    // A floor two voxels high, so that every voxel has a free face at every level. All points of some voxels have no
    // colour.
    let (mut points, mut rows) = (Vec::new(), String::from("x,y,z,r,g,b\n"));
    for k in 0..4000_i64 {
        let voxel = [(k * 7) % 50 - 20, (k * 11) % 23 - 9, k % 2];
        let is_coloured = (voxel[0] + voxel[1]) % 5 != 0;
        let colour = if voxel[0] < 4 { [250, 20, 10] } else { [k % 256, k / 3 % 256, 9] };
        let [x, y, z] = voxel.map(|at| (at as f64 + 0.5) * EDGE_M);
        let [red, green, blue] = if is_coloured { colour } else { [-1; 3] };
        rows += &format!("{x},{y},{z},{red},{green},{blue}\n");
        points.push((voxel, is_coloured.then_some(colour)));
    }
    // Poses are looked for in the folder above, too.
    let cloud = folder.path().join("clouds").join("floor.csv");
    fs::create_dir(folder.path().join("clouds")).unwrap();
    fs::write(&cloud, rows).unwrap();
    let build = |name: &str, layers: &str| {
        let map = text(&folder.path().join(name)).to_owned();
        let options = ["--no-rays", "--resolution", "0.5", "--tile-size", "8", "--layers", layers];
        output(&[&["build", text(&cloud), "-o", &map][..], &options].concat());
        map
    };
    let (map, plain) = (build("map", "colour"), build("plain", "none"));
    let tiles = |map: &str, name: &str, options: &[&str]| {
        exported(map, &folder.path().join(name), &[&["--format", "3dtiles"], options].concat())
    };
    let meshes = |tiles: &Path| {
        let mut meshes: Vec<(Vec<i64>, PathBuf)> = Vec::new();
        let mut open = vec![tiles.join("node")];
        while let Some(path) = open.pop() {
            if path.is_dir() {
                open.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
                continue;
            }
            let key = path.with_extension("");
            let key = key.strip_prefix(tiles.join("node")).unwrap().iter();
            meshes.push((key.map(|part| part.to_str().unwrap().parse().unwrap()).collect(), path));
        }
        meshes.sort();
        meshes
    };
    let coloured = meshes(&tiles(&map, "coloured", &[]));
    let mut found: BTreeMap<i64, BTreeSet<(Voxel, [u8; 3])>> = BTreeMap::new();
    for (key, mesh) in &coloured {
        let first = [1, 2, 3].map(|k| key[k] * TILE_EDGE);
        let faces = face_colours(mesh).into_iter();
        let in_map = faces.map(|(voxel, colour)| ([0, 1, 2].map(|k| first[k] + voxel[k]), colour));
        found.entry(key[0]).or_default().extend(in_map);
    }
    assert!(found.len() > 1, "{:?}", found.keys());
    for (level, found) in found {
        let mut sums: BTreeMap<Voxel, (i64, [i64; 3])> = BTreeMap::new();
        for (voxel, colour) in &points {
            let (count, sum) = sums.entry(voxel.map(|at| at >> level)).or_default();
            if let Some(colour) = colour {
                *count += 1;
                (0..3).for_each(|k| sum[k] += colour[k]);
            }
        }
        let mean = |(count, sum): (i64, [i64; 3])| match count {
            0 => [128; 3],
            count => sum.map(|sum| ((sum as f64 / count as f64).round()) as u8),
        };
        let expected: BTreeSet<_> = sums.into_iter().map(|(voxel, sum)| (voxel, mean(sum))).collect();
        let is_gray = |(_, colour): &(Voxel, [u8; 3])| *colour == [128; 3];
        assert!(level > 0 || expected.iter().any(is_gray));
        assert!(found == expected, "level {level}: {:?}", found.symmetric_difference(&expected).next());
    }
    // Without the colours the files are those of a map without them.
    let [left_out, plain] = [(&map, "left_out", &["--no-layers"][..]), (&plain, "none", &[])]
        .map(|(map, name, options)| meshes(&tiles(map, name, options)));
    assert_eq!((left_out.len(), plain.len()), (coloured.len(), coloured.len()));
    for (number, (key, mesh)) in left_out.iter().enumerate() {
        let [bytes, of_plain, of_coloured] =
            [mesh, &plain[number].1, &coloured[number].1].map(|mesh| fs::read(mesh).unwrap());
        assert!(bytes == of_plain && bytes != of_coloured, "{key:?}");
    }
}

#[test]
fn voxels_of_classes_are_exported() {
    let folder = TempDir::new().unwrap();
    let map = map_of(&folder, "map", "class");
    let all = table(&exported(&map, &folder.path().join("all.csv"), &[]));
    let classes: BTreeSet<&String> = all.values().map(|row| &row["class"]).collect();
    assert!(classes.len() > 2, "{classes:?}");
    let some: Vec<&str> =
        classes.iter().map(|class| class.as_str()).filter(|class| !class.is_empty()).take(2).collect();
    for (name, picked) in [("one", &some[..1]), ("two", &some[..])] {
        let (list, file) = (picked.join(","), folder.path().join(format!("{name}.csv")));
        let found = table(&exported(&map, &file, &["--only-class", &list]));
        let expected = all.iter().filter(|(_, row)| picked.contains(&row["class"].as_str()));
        assert!(found.iter().eq(expected), "{name}");
        // Another way of counting, and without layers in the file.
        let file = text(&folder.path().join(format!("{name}.npz"))).to_owned();
        let written = json(&["export", &map, "-o", &file, "--only-class", &list, "--no-layers", "--json"]);
        assert_eq!(written["voxels"], found.len(), "{written}");
    }
    let refused = |map: &str, name: &str| {
        let file = folder.path().join(name);
        let (code, message) = failure(&["export", map, "-o", text(&file), "--only-class", "2"]);
        assert!(code == 2 && !file.exists(), "{message}");
        message
    };
    assert!(refused(&map, "a.bt").contains("bt does not support it"));
    let plain = map_of(&folder, "plain", "colour");
    for name in ["a.csv", "a.npz"] {
        assert!(refused(&plain, name).contains("-o NEW --layers class"));
    }
}

#[test]
fn occupied_voxels_are_forgotten_by_their_last_hit() {
    let folder = TempDir::new().unwrap();
    let map = map_of(&folder, "map", "time");
    let count = |map: &str| json(&["info", map, "--json"])["occupied"].as_u64().unwrap();
    let before = count(&map);
    // The two scans are a second apart.
    let nothing = json(&["decay", &map, "--older-than", "1s", "--json"]);
    assert_eq!((&nothing["voxels_forgotten"], count(&map)), (&0.into(), before), "{nothing}");
    let some = json(&["decay", &map, "--older-than", "500ms", "--json"]);
    let forgotten = some["voxels_forgotten"].as_u64().unwrap();
    assert!(forgotten > 0 && count(&map) == before - forgotten, "{some}");
    assert_eq!(some["oldest_ns"], 1_700_000_001_000_000_000_i64, "{some}");
    let printed = output(&["decay", &map, "--older-than", "1d", "--now", "1800000000"]);
    assert!(printed.contains("older than 1day") && count(&map) == 0, "{printed}");
    let wrong = |more: &[&str]| failure(&[&["decay", &map][..], more].concat());
    assert!(wrong(&[]).1.contains("--halflife"));
    assert!(wrong(&["--older-than", "soon"]).1.contains("--older-than"));
    assert!(wrong(&["--older-than", "1s", "--now", "1e300"]).1.contains("not a time"));
    assert_eq!(wrong(&["--older-than", "1s", "--halflife", "3"]).0, 2);
    let plain = map_of(&folder, "plain", "colour");
    let (code, message) = failure(&["decay", &plain, "--older-than", "1s"]);
    assert!(code == 2 && message.contains("--layers time"), "{message}");
}
