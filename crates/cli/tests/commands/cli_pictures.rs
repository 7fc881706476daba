use crate::cli::{failure, json, map_with_a_passer_by, output, scans, text, voxtile};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Builds a map of three scans of a wall.
fn map(folder: &TempDir) -> PathBuf {
    let map = folder.path().join("map");
    output(&["build", text(&scans(folder)), "-o", text(&map)]);
    map
}

/// Returns width, height and pixels of a PNG.
fn decoded(png: &[u8]) -> (usize, usize, Vec<[u8; 3]>) {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks_exact(3).map(|pixel| pixel.try_into().unwrap()).collect();
    (info.width as usize, info.height as usize, pixels)
}

fn pixels_of(path: &Path) -> (usize, usize, Vec<[u8; 3]>) {
    decoded(&fs::read(path).unwrap())
}

#[test]
fn a_picture_matches_its_json() {
    let folder = TempDir::new().unwrap();
    let (map, file) = (map(&folder), folder.path().join("map.png"));
    let printed = json(&["picture", text(&map), "-o", text(&file), "--json"]);
    let (width, height, pixels) = pixels_of(&file);
    assert_eq!(
        (printed["width_px"].as_u64(), printed["height_px"].as_u64()),
        (Some(width as u64), Some(height as u64))
    );
    assert_eq!((printed["color"].as_str(), printed["from"].as_str()), (Some("height"), Some("above")));
    // The trajectory from the map's list of scans.
    assert!(pixels.contains(&voxtile_render::colors::PATH));
    let without = folder.path().join("without.png");
    output(&["picture", text(&map), "-o", text(&without), "--no-path", "--no-grid"]);
    assert!(!pixels_of(&without).2.contains(&voxtile_render::colors::PATH));
    for more in [
        &["--from", "side-x"][..],
        &["--from", "side-y", "--color", "count"],
        &["--slice", "0.55", "--color", "probability"],
        &["--color", "last-scan", "--region", "-1", "-1", "-1", "9", "9", "9"],
        &["--slice", "0.5", "--thickness", "1", "--size", "300"],
        &["--from", "oblique", "--azimuth", "-120", "--elevation", "25", "--color", "count"],
    ] {
        let printed = json(&[&["picture", text(&map), "-o", text(&file), "--json"], more].concat());
        assert!(printed["known_cells"].as_u64() > Some(0), "{more:?}: {printed}");
        let [left, top, wide, high] = [0, 1, 2, 3].map(|k| printed["map_px"][k].as_u64().unwrap() as usize);
        let (width, height, _) = pixels_of(&file);
        assert!(left + wide <= width && top + high <= height, "{printed}");
        assert!(wide.max(high) <= if more.contains(&"--size") { 300 } else { 2048 }, "{printed}");
    }
    let [cividis, gray] = ["cividis", "gray"].map(|name| {
        let printed = json(&["picture", text(&map), "-o", text(&file), "--color-map", name, "--json"]);
        assert_eq!(printed["color_map"], name);
        pixels_of(&file).2
    });
    let printed = json(&[
        "picture",
        text(&map),
        "-o",
        text(&file),
        "--dpi",
        "300",
        "--background",
        "transparent",
        "--json",
    ]);
    let bytes = fs::read(&file).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().unwrap();
    let info = reader.info();
    assert_eq!(info.pixel_dims.map(|dims| (dims.xppu, dims.unit)), Some((11_811, png::Unit::Meter)));
    assert_eq!((info.color_type, printed["dpi"].as_f64()), (png::ColorType::Rgba, Some(300.0)));
    // The legend has the highest color even if the map is dark.
    let highest = |name: &str| voxtile_render::ColorMap::named(name).unwrap().color_of(1.0);
    assert!(cividis.contains(&highest("cividis")) && !cividis.contains(&highest("gray")));
    assert!(gray.contains(&highest("gray")) && !gray.contains(&highest("cividis")));
    // On standard output; the summary is on standard error.
    let run = voxtile(&["picture", text(&map), "-o", "-", "--json"]).assert().success();
    let bytes = run.get_output();
    assert_eq!(decoded(&bytes.stdout).0, width);
    assert!(String::from_utf8_lossy(&bytes.stderr).contains("\"width_px\""));
}

#[test]
fn changes_since_a_snapshot_are_drawn() {
    let folder = TempDir::new().unwrap();
    let (map, file) = (map(&folder), folder.path().join("map.png"));
    output(&["snapshot", text(&map), "before"]);
    output(&["clear", text(&map), "--region", "3", "-9", "-9", "9", "0", "9"]);
    let args =
        |since: &str| output(&["picture", text(&map), "-o", text(&file), "--since", since, "--no-path"]);
    args("before");
    let (.., pixels) = pixels_of(&file);
    let count = |color: [u8; 3], pixels: &[[u8; 3]]| pixels.iter().filter(|&&pixel| pixel == color).count();
    use voxtile_render::colors::{APPEARED, SAME, VANISHED};
    // The legend has a few pixels of each color.
    assert!(count(VANISHED, &pixels) > 10 * count(APPEARED, &pixels), "the cleared half of the wall");
    assert!(count(SAME, &pixels) > 10 * count(APPEARED, &pixels), "the other half");
    let snapshot = format!("{}@before", text(&map));
    let printed = json(&["picture", &snapshot, "-o", text(&file), "--since", text(&map), "--json"]);
    assert!(printed["color"].is_null());
    let (.., pixels) = pixels_of(&file);
    assert!(count(APPEARED, &pixels) > 10 * count(VANISHED, &pixels));
    let (code, error) = failure(&["picture", text(&map), "-o", text(&file), "--since", "nothing"]);
    assert!(code != 0 && error.contains("nothing"), "{error}");
}

#[test]
fn points_marked_as_moving_are_drawn() {
    let folder = TempDir::new().unwrap();
    let (moved, file) = (map_with_a_passer_by(folder.path()).0, folder.path().join("moved.png"));
    let (moved, file) = (text(&moved), text(&file));
    // With swatches of one size.
    let always = ["picture", moved, "-o", file, "--json", "--dpi", "100"];
    let draw = |more: &[&str]| json(&[&always[..], more].concat());
    let red = || {
        let (.., pixels) = pixels_of(Path::new(file));
        pixels.iter().filter(|&&pixel| pixel == voxtile_render::colors::MOVING).count()
    };
    let counts = |printed: &Value| (printed["moving_points"].clone(), printed["marked_points"].clone());
    assert_eq!(counts(&draw(&["--moving"])), (0.into(), 0.into()));
    let swatch = red();
    let said = output(&["picture", moved, "-o", file, "--moving"]);
    assert!(said.contains("no point is marked as moving: `voxtile clean` marks them"), "{said}");
    let marked = json(&["clean", moved, "--keep-as", "before", "--json"])["points_changed"].clone();
    assert_eq!(counts(&draw(&[])), (Value::Null, Value::Null));
    assert_eq!(red(), 0);

    // What passed is 2.5 m in front of the sensor, up to 0.4 m to each side.
    let all = (marked.clone(), marked.clone());
    for more in [
        &["--moving"][..],
        &["--moving", "--from", "side-x"],
        &["--moving", "--slice", "0", "--thickness", "2"],
        &["--moving", "--region", "2", "-1", "-1", "3", "1", "1"],
        &["--moving", "--since", "before"],
        &["--moving", "--size", "64"],
    ] {
        assert_eq!(counts(&draw(more)), all, "{more:?}");
        assert!(red() > swatch, "{more:?}: {}", red());
    }
    let layer = draw(&["--moving", "--slice", "0"]);
    assert!(layer["moving_points"].as_u64() > Some(0) && layer["moving_points"].as_u64() < marked.as_u64());
    assert_eq!(layer["marked_points"], marked);
    let elsewhere = ["--moving", "--region", "4", "-9", "-9", "9", "9", "9"];
    assert_eq!(counts(&draw(&elsewhere)), (0.into(), marked.clone()));
    let said = output(&[&["picture", moved, "-o", file][..], &elsewhere].concat());
    assert!(said.contains("; 0 of ") && said.contains(" moving points"), "{said}");
    // A snapshot has its own marks.
    let before = json(&["picture", &format!("{moved}@before"), "-o", file, "--moving", "--json"]);
    assert_eq!(counts(&before), (0.into(), 0.into()));
}

#[test]
fn maps_without_kept_scans_have_no_moving_points() {
    let folder = TempDir::new().unwrap();
    let (map, tree, file) = (map(&folder), folder.path().join("a.bt"), folder.path().join("a.png"));
    output(&["export", text(&map), "-o", text(&tree)]);
    for (map, reason) in [(&map, "--keep-scans"), (&tree, "OctoMap")] {
        let (code, error) = failure(&["picture", text(map), "-o", text(&file), "--moving"]);
        assert!(code == 2 && error.contains("--moving") && error.contains(reason), "{error}");
        assert!(!file.exists());
    }
}

#[test]
fn impossible_pictures_are_refused() {
    let folder = TempDir::new().unwrap();
    let (map, file) = (map(&folder), folder.path().join("map.png"));
    let (code, error) = failure(&["picture", text(&map)]);
    assert!(code == 2 && error.contains("--output <FILE>"), "{error}");
    let (code, error) =
        failure(&["picture", text(&map), "-o", text(&file), "--slice", "1", "--from", "side-x"]);
    assert!(code == 2 && error.contains("--slice"), "{error}");
    for wrong in [
        &["--slice", "nan"][..],
        &["--region", "1", "1", "1", "0", "2", "2"],
        &["--size", "17000"],
        &["--dpi", "1"],
        &["--from", "oblique", "--elevation", "91"],
        &["--from", "oblique", "--since", text(&map)],
        &["--from", "oblique", "--slice", "1"],
        &["--from", "oblique", "--moving"],
        &["--color-map", "turbo"],
        &["--color-map", "gray", "--since", text(&map)],
        &["--color-map", "gray", "--color", "rgb"],
    ] {
        let (code, _) = failure(&[&["picture", text(&map), "-o", text(&file)], wrong].concat());
        assert_eq!(code, 2, "{wrong:?}");
    }
    assert!(!file.exists());
    let table = map.join("tile_0_0_0/iwlo_meta.bin");
    let mut bytes = fs::read(&table).unwrap();
    bytes[40] ^= 1;
    fs::write(&table, bytes).unwrap();
    let (code, error) = failure(&["picture", text(&map), "-o", text(&file)]);
    assert!(code == 1 && error.contains("tile (0, 0, 0)"), "{error}");
    assert!(!file.exists());
    // The report has everything else and names the damage.
    let page = folder.path().join("page.html");
    let printed = json(&["report", text(&map), "-o", text(&page), "--json"]);
    assert_eq!(
        (printed["readable"].as_bool(), printed["damage"].as_u64()),
        (Some(true), Some(1)),
        "{printed}"
    );
    let page = fs::read_to_string(&page).unwrap();
    assert!(page.contains("Damaged: 1 finding,") && page.contains("iwlo_meta.bin"), "{page}");
    assert!(page.contains("1 tile cannot be read"));
}

#[test]
fn a_file_of_octomap_has_a_picture_and_no_counts() {
    let folder = TempDir::new().unwrap();
    let (map, tree, file) = (map(&folder), folder.path().join("a.bt"), folder.path().join("a.png"));
    output(&["export", text(&map), "-o", text(&tree)]);
    let printed = json(&["picture", text(&tree), "-o", text(&file), "--json"]);
    let of_map = json(&["picture", text(&map), "-o", text(&file), "--json"]);
    assert_eq!(printed["solid_cells"], of_map["solid_cells"]);
    let (code, error) = failure(&["picture", text(&tree), "-o", text(&file), "--color", "count"]);
    assert!(code == 2 && error.contains("counts"), "{error}");
}

/// Builds a map of a room of 6 x 4 x 3 m, with or without ceiling, from its middle.
fn room(folder: &Path, has_ceiling: bool) -> PathBuf {
    let mut points = String::new();
    let steps = |edge_m: f64| (0..=(edge_m * 10.0) as i32).map(move |k| f64::from(k) * 0.1 - 0.5 * edge_m);
    for x in steps(6.0) {
        for y in steps(4.0) {
            points += &format!("{x} {y} -1.25\n");
            if has_ceiling {
                points += &format!("{x} {y} 1.75\n");
            }
        }
        for z in steps(2.0) {
            points += &format!("{x} -2 {z}\n{x} 2 {z}\n");
        }
    }
    let (file, map) = (folder.join("room.xyz"), folder.join(format!("room_{has_ceiling}")));
    fs::write(&file, points).unwrap();
    let origin = ["--sensor-origin", "0.05", "0.05", "0.05"];
    output(&[&["build", text(&file), "-o", text(&map)][..], &origin].concat());
    map
}

#[test]
fn ceilings_of_rooms_are_cut() {
    let folder = TempDir::new().unwrap();
    let [room, open] = [true, false].map(|has_ceiling| room(folder.path(), has_ceiling));
    let file = folder.path().join("room.png");
    let draw = |map: &Path, more: &[&str]| {
        json(&[&["picture", text(map), "-o", text(&file), "--json"], more].concat())
    };
    for more in [&[][..], &["--from", "oblique"], &["--color", "count"]] {
        let cut = draw(&room, more);
        assert_eq!(cut["max_height_m"], 0.05, "{cut}");
        assert_eq!(draw(&open, more)["max_height_m"], Value::Null);
    }
    assert!(draw(&room, &[])["range"][1].as_f64() < Some(0.05));
    let region = ["--region", "-9", "-9", "-9", "9", "9", "9"];
    for more in [&["--max-height", "none"][..], &["--from", "side-x"], &["--slice", "1.75"], &region] {
        let whole = draw(&room, more);
        assert_eq!(whole["max_height_m"], Value::Null, "{more:?}");
        assert!(whole["range"][1].as_f64() > Some(1.0), "{whole}");
    }
    output(&["snapshot", text(&room), "one"]);
    assert_eq!(draw(&room, &["--since", "one"])["max_height_m"], Value::Null);
    assert_eq!(draw(&open, &["--max-height", "-1"])["range"][1].as_f64().map(|m| m < -1.0), Some(true));
    let said = output(&["picture", text(&room), "-o", text(&file)]);
    assert!(said.contains("ceiling cut at 0.05 m, the height of the sensor"), "{said}");
    let page = folder.path().join("room.html");
    let report = |more: &[&str]| {
        let printed = json(&[&["report", text(&room), "-o", text(&page), "--json"], more].concat());
        let page = fs::read_to_string(&page).unwrap();
        (printed["max_height_m"].clone(), page.contains("without the ceiling, up to the sensor at 0.05 m"))
    };
    assert_eq!(report(&[]), (0.05.into(), true));
    assert_eq!(report(&["--max-height", "none"]), (Value::Null, false));
    let highest = voxtile_render::ColorMap::named("cividis").unwrap().color_of(1.0);
    let [red, green, blue] = highest;
    let bar = format!("rgb({red},{green},{blue})");
    let has_bar = || fs::read_to_string(&page).unwrap().contains(&bar);
    assert!(!has_bar());
    report(&["--color-map", "cividis"]);
    assert!(has_bar(), "{bar}");
    let (code, error) = failure(&["picture", text(&room), "-o", text(&file), "--max-height", "high"]);
    assert!(code == 2 && error.contains("a height in metres"), "{error}");
    let (code, error) = failure(&["picture", text(&room), "-o", text(&file), "--azimuth", "12"]);
    assert!(code == 2 && error.contains("--from oblique"), "{error}");
}

/// The report is valid XML with the numbers of `info`, and refers to no other resource.
#[test]
fn a_report_has_the_numbers_of_info() {
    let folder = TempDir::new().unwrap();
    let (map, page) = (map(&folder), folder.path().join("page.html"));
    output(&["snapshot", text(&map), "before"]);
    output(&["report", text(&map), "-o", text(&page)]);
    let page = fs::read_to_string(&page).unwrap();
    check_markup(&page);
    let info = json(&["info", text(&map), "--json"]);
    for (name, key) in [
        ("voxels", "voxels"),
        ("occupied", "occupied"),
        ("tiles", "tiles"),
        ("bytes of tables", "table_bytes"),
        ("bytes of octrees", "octree_bytes"),
        ("scans", "scan_number"),
    ] {
        let row = format!("<tr><th>{name}</th><td>");
        let value = page.split_once(&row).unwrap().1.split_once('<').unwrap().0.replace(',', "");
        assert_eq!(value, info[key].to_string(), "{name}");
    }
    assert!(page.contains(info["map_id"].as_str().unwrap()));
    assert!(page.contains("Intact: all checksums match") && page.contains("<td>before</td>"));
    assert_eq!(page.matches("data:image/png;base64,").count(), 2);
    for outside in ["http://", "https://", "<script", "<link", "@import", "url("] {
        let page = page.replace("http://www.w3.org/1999/xhtml", "");
        assert!(!page.contains(outside), "{outside}");
    }
    let snapshot = format!("{}@before", text(&map));
    let other = folder.path().join("snapshot.html");
    output(&["report", &snapshot, "-o", text(&other), "--no-verify"]);
    check_markup(&fs::read_to_string(other).unwrap());
}

/// Builds a map of a floor (class 2, brown) with a box (class 6, red), with colours, intensities and classes.
fn coloured_map(folder: &Path, layers: &str) -> PathBuf {
    let mut rows = String::from("x,y,z,intensity,r,g,b,class\n");
    for (x, y) in (0..40).flat_map(|x| (0..40).map(move |y| (x, y))) {
        let is_box = (10..20).contains(&x) && (10..20).contains(&y);
        let (z, attributes) = if is_box { (1.05, "90,250,20,10,6") } else { (0.05, "30,120,80,40,2") };
        rows += &format!("{},{},{z},{attributes}\n", 0.05 + 0.1 * f64::from(x), 0.05 + 0.1 * f64::from(y));
    }
    let (cloud, map) = (folder.join("floor.csv"), folder.join("coloured"));
    fs::write(&cloud, rows).unwrap();
    output(&[
        "build",
        text(&cloud),
        "-o",
        text(&map),
        "--no-rays",
        "--resolution",
        "0.1",
        "--layers",
        layers,
    ]);
    map
}

#[test]
fn pictures_by_layers_have_their_colors() {
    use voxtile_render::classes::class_color;
    let folder = TempDir::new().unwrap();
    let (map, file) = (coloured_map(folder.path(), "colour,intensity,class"), folder.path().join("map.png"));
    let count = |color: [u8; 3]| pixels_of(&file).2.iter().filter(|&&pixel| pixel == color).count();
    let draw = |color: &str| {
        json(&["picture", text(&map), "-o", text(&file), "--no-grid", "--json", "--color", color])
    };
    let printed = draw("rgb");
    assert_eq!((printed["color"].as_str(), printed["range"].is_null()), (Some("rgb"), true));
    let of_cell = printed["cell_px"].as_u64().unwrap().pow(2) as usize;
    // Shading changes the colors at the borders of the box.
    assert!(count([120, 80, 40]) > 1400 * of_cell && count([250, 20, 10]) >= 60 * of_cell);
    let printed = draw("class");
    assert_eq!(printed["classes"], serde_json::json!({"2": 1500, "6": 100}));
    assert!(count(class_color(2)) > 1400 * of_cell && count(class_color(6)) >= 60 * of_cell);
    let said = output(&["picture", text(&map), "-o", text(&file), "--color", "class"]);
    assert!(said.contains("classes 2 ground, 6 building"), "{said}");
    let range = draw("intensity")["range"].clone();
    let ends = [0, 1].map(|k| range[k].as_f64().unwrap().round());
    assert_eq!(ends, [30.0, 90.0]);
    assert!(count(voxtile_render::colors::color_of(0.0)) > 1400 * of_cell);
    assert!(draw("height")["classes"].is_null());
    let (code, error) = failure(&["picture", text(&map), "-o", text(&file), "--color", "age"]);
    assert!(code == 2 && error.contains("--color") && error.contains("--layers time"), "{error}");
}

#[test]
fn a_report_has_pictures_in_color_and_a_table_of_classes() {
    let folder = TempDir::new().unwrap();
    let (map, file) = (coloured_map(folder.path(), "colour,class"), folder.path().join("page.html"));
    let printed = json(&["report", text(&map), "-o", text(&file), "--json"]);
    assert_eq!(printed["survey"]["classes"], serde_json::json!({"2": 1500, "6": 100}));
    let page = fs::read_to_string(&file).unwrap();
    check_markup(&page);
    assert_eq!(page.matches("data:image/png;base64,").count(), 4);
    let row = "<tr><td>2 ground</td><td class=\"number\">1,500</td><td class=\"number\">93.8 %</td></tr>";
    assert!(
        page.contains(row) && page.contains("<td>6 building</td>") && !page.contains("no class"),
        "{page}"
    );
}

#[test]
fn hostile_names_are_escaped_in_a_report() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let input = folder.path().join("<img src=x onerror=alert(1)>&");
    fs::rename(&scans, &input).unwrap();
    let map = folder.path().join("a<script>alert('1')<&\"b");
    output(&["build", text(&input), "-o", text(&map)]);
    let page = folder.path().join("page.html");
    output(&["report", text(&map), "-o", text(&page)]);
    let page = fs::read_to_string(&page).unwrap();
    check_markup(&page);
    assert!(page.contains("a&lt;script&gt;alert(&#39;1&#39;)&lt;&amp;&quot;b"), "the name as text");
    assert!(!page.contains("<script") && !page.contains("<img src=x"));
}

#[test]
fn maps_without_voxels_and_with_one_have_pictures_and_reports() {
    let folder = TempDir::new().unwrap();
    let (png, page) = (folder.path().join("a.png"), folder.path().join("a.html"));
    let empty = folder.path().join("empty");
    let config = voxtile::MapConfig::new(0.1, 10.0).unwrap();
    drop(voxtile::OutOfCoreTileMapper::create(&empty, config).unwrap());
    let cloud = folder.path().join("one.pcd");
    let header = "FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nDATA ascii\n";
    fs::write(&cloud, format!("{header}0.04 0.04 0.04\n")).unwrap();
    let one = folder.path().join("one");
    output(&["build", text(&cloud), "-o", text(&one), "--no-rays"]);
    for (map, cells) in [(&empty, 0), (&one, 1)] {
        let printed = json(&["picture", text(map), "-o", text(&png), "--json"]);
        assert_eq!(printed["known_cells"], cells, "{printed}");
        assert!(pixels_of(&png).0 > 100);
        output(&["report", text(map), "-o", text(&page)]);
        check_markup(&fs::read_to_string(&page).unwrap());
    }
}

#[test]
fn a_map_that_does_not_open_has_a_report_of_its_damage() {
    let folder = TempDir::new().unwrap();
    let (map, page) = (map(&folder), folder.path().join("page.html"));
    let log = map.join("commits.log");
    let mut bytes = fs::read(&log).unwrap();
    bytes.iter_mut().for_each(|byte| *byte = !*byte);
    fs::write(&log, bytes).unwrap();
    let printed = json(&["report", text(&map), "-o", text(&page), "--json"]);
    assert!(printed["damage"].as_u64() > Some(0), "{printed}");
    let page = fs::read_to_string(&page).unwrap();
    check_markup(&page);
    assert!(page.contains("commits.log"), "{page}");
    let (code, error) =
        failure(&["report", text(&folder.path().join("none")), "-o", text(&folder.path().join("x"))]);
    assert!(code != 0 && error.contains("no map here"), "{error}");
}

/// Checks that all elements are closed and all special characters are escaped.
fn check_markup(page: &str) {
    let mut open: Vec<&str> = Vec::new();
    let body = page.strip_prefix("<!DOCTYPE html>").unwrap();
    for piece in body.split('<').skip(1) {
        let (tag, content) = piece.split_once('>').unwrap();
        // No attribute contains an angle bracket; otherwise the check for tags would be wrong.
        assert_eq!(tag.matches('"').count() % 2, 0, "<{tag}>");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split_whitespace().next().unwrap());
        }
        assert!(!content.contains('>') || open.last() == Some(&"style"), "{content}");
        for entity in content.split('&').skip(1) {
            assert!(
                ["amp;", "lt;", "gt;", "quot;", "#39;"].iter().any(|known| entity.starts_with(known)),
                "{entity}"
            );
        }
        assert!(content.chars().all(|letter| !letter.is_control() || letter == '\n'));
    }
    assert!(open.is_empty(), "{open:?}");
}
