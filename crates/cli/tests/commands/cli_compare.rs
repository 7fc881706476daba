use super::cli::{failure, json, output, scans, text, voxtile};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;
use voxtile::{Clearing, MapConfig, MapOptions, Mapper, Scan};

/// Makes a map of six scans from the origin, whose 5 x 5 rays end at `x` m in different voxels.
pub fn wall_at(folder: &Path, name: &str, x: f64, resolution_m: f64, crs: Option<&str>) -> PathBuf {
    let map = folder.join(name);
    let mut config = MapConfig::new(resolution_m, 10.0).unwrap().with_clearing(Clearing::guarded());
    config.crs = crs.map(str::to_owned);
    let mut mapper = MapOptions::new().config(config).create_new(true).open(&map).unwrap();
    let across = [-0.15, -0.05, 0.05, 0.15, 0.25];
    let points =
        across.iter().flat_map(|y| across.iter().map(move |z| [1.0, *y / 2.05, *z / 2.05].map(|k| k * x)));
    let scan = Scan { points: points.collect(), ..Scan::default() };
    for _ in 0..6 {
        mapper.insert_scan(&scan).unwrap();
    }
    mapper.flush().unwrap();
    map
}

#[test]
fn changes_are_counted_listed_and_written() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let before = wall_at(folder.path(), "before", 2.05, 0.1, Some("EPSG:25832"));
    let after = wall_at(folder.path(), "after", 4.05, 0.1, None);
    let maps = ["compare", text(&before), text(&after)];
    let run = |more: &[&str]| json(&[&maps[..], more, &["--json"]].concat());
    let found = run(&[]);
    // Voxels at the border of what the later map has seen are uncertain.
    let before_counts =
        ["occupied", "changed", "uncertain"].map(|count| found["before"][count].as_u64().unwrap());
    assert_eq!(before_counts, [25, 9, 16], "{found}");
    assert_eq!(
        (&found["after"]["occupied"], &found["after"]["not_seen"]),
        (&25.into(), &25.into()),
        "{found}"
    );
    assert_eq!((&found["vanished"]["clusters"], &found["appeared"]["clusters"]), (&1.into(), &0.into()));
    let change = &found["changes"][0];
    assert_eq!(
        (&change["kind"], &change["voxels"], &change["number"]),
        (&"vanished".into(), &9.into(), &1.into())
    );
    assert_eq!(change["bounds_m"], serde_json::json!({"min": [2.0, -0.1, -0.1], "max": [2.1, 0.2, 0.2]}));
    assert_eq!((&found["tolerance_voxels"], &found["crs"]), (&1.into(), &"EPSG:25832".into()));
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("only one of the maps names a coordinate"), "{warnings}");

    // The reverse: what appeared is known now, what is behind it is not.
    let back = json(&["compare", text(&after), text(&before), "--json"]);
    assert_eq!((&back["before"]["not_seen"], &back["after"]["changed"]), (&25.into(), &9.into()));
    // Files.
    let (csv, geojson, all_json) = (path("a.csv"), path("a.geojson"), path("a.json"));
    for list in [&csv, &geojson, &all_json] {
        assert_eq!(run(&["--list", text(list)])["list"], text(list));
    }
    let lines = fs::read_to_string(&csv).unwrap();
    assert!(
        lines.starts_with("number,kind,voxels,volume_m3,min_x") && lines.contains("\n1,vanished,9,"),
        "{lines}"
    );
    let features: serde_json::Value = serde_json::from_slice(&fs::read(&geojson).unwrap()).unwrap();
    assert_eq!(features["crs"]["properties"]["name"], "urn:ogc:def:crs:EPSG::25832");
    assert_eq!(features["features"][0]["geometry"]["coordinates"][0][2], serde_json::json!([2.1, 0.2]));
    let listed: serde_json::Value = serde_json::from_slice(&fs::read(&all_json).unwrap()).unwrap();
    assert_eq!(listed["changes"], found["changes"]);
    for (file, options, voxels) in
        [("v.ply", &[][..], 9), ("all.ply", &["--all"], 50), ("v.csv", &[], 9), ("v.las", &[], 9)]
    {
        let file = path(file);
        let written = run(&[&["-o", text(&file)][..], options].concat());
        assert_eq!(written["output_voxels"], voxels, "{written}");
        if text(&file).ends_with(".csv") {
            let lines = fs::read_to_string(&file).unwrap();
            assert!(lines.lines().count() == 10 && lines.contains(",66"), "{lines}");
        }
        if text(&file).ends_with(".las") {
            // Point format 7: the class is byte 16 of a point.
            let bytes = fs::read(&file).unwrap();
            let first = u32::from_le_bytes(bytes[96..100].try_into().unwrap()) as usize;
            assert_eq!((bytes[104] & 63, bytes[first + 16]), (7, 66));
        }
    }
    let summary = output(&maps);
    for part in [
        "tolerance 1 voxel (0.100 m)",
        "vanished  1 cluster of 9 voxels",
        "1  vanished 9 voxels at 2.1 0.1 0.1",
    ] {
        assert!(summary.contains(part), "{summary}");
    }
    assert!(run(&["--min-voxels", "26"])["vanished"]["small_voxels"] == 9);
    assert!(run(&["--region", "3", "-1", "-1", "5", "1", "1"])["before"]["occupied"] == 0);
    // Octree files.
    let bt = path("after.bt");
    output(&["export", text(&after), "-o", text(&bt)]);
    let of_file = json(&["compare", text(&before), text(&bt), "--json"]);
    assert_eq!(of_file["changes"], found["changes"]);
    assert!(of_file["warnings"].to_string().contains("OctoMap's rule of clearing"), "{of_file}");
}

#[test]
fn doubtful_and_unsuitable_maps_are_named() {
    let folder = TempDir::new().unwrap();
    let of = |name: &str, x, resolution_m, crs| wall_at(folder.path(), name, x, resolution_m, crs);
    let map = of("map", 2.05, 0.1, None);
    output(&["snapshot", text(&map), "first"]);
    let snapshot = format!("{}@first", text(&map));
    let found = json(&["compare", &snapshot, text(&map), "--json"]);
    assert_eq!((&found["before"]["unchanged"], &found["maps"][0]["snapshot"]), (&25.into(), &"first".into()));
    assert!(found["warnings"].to_string().contains("states of one map"), "{found}");
    // Maps of the same scans, by OctoMap's rule.
    let input = scans(&folder);
    let [one, two] = ["one", "two"].map(|name| folder.path().join(name));
    for map in [&one, &two] {
        output(&["build", text(&input), "-o", text(map)]);
    }
    let found = json(&["compare", text(&one), text(&two), "--json"]);
    let warnings = found["warnings"].to_string();
    assert!(warnings.contains("contain scans of") && warnings.contains("--clearing guarded"), "{warnings}");
    assert!(found["changes"] == serde_json::json!([]) && found["before"]["changed"] == 0, "{found}");
    // Other space, another resolution, another system.
    let cropped = folder.path().join("cropped");
    let box_m = ["--region", "1", "-1", "-1", "3", "1", "1"];
    output(&[&["crop", text(&map), "-o", text(&cropped)][..], &box_m].concat());
    let far = folder.path().join("far");
    let whole = of("whole", 60.05, 0.1, None);
    let box_m = ["--region", "50", "-1", "-1", "70", "1", "1"];
    output(&[&["crop", text(&whole), "-o", text(&far)][..], &box_m].concat());
    let found = json(&["compare", text(&cropped), text(&far), "--json"]);
    assert!(found["warnings"][0].as_str().unwrap().contains("have no place in common"), "{found}");
    assert_eq!(found["before"]["not_seen"], 25);
    let coarse = of("coarse", 2.05, 0.2, None);
    let (code, message) = failure(&["compare", text(&map), text(&coarse)]);
    assert!(code == 2 && message.contains("0.1 m and 0.2 m cannot be compared"), "{message}");
    let (utm, other) = (of("utm", 2.05, 0.1, Some("EPSG:25832")), of("other", 2.05, 0.1, Some("EPSG:25833")));
    let (code, message) = failure(&["compare", text(&utm), text(&other)]);
    assert!(code != 0 && message.contains("coordinate reference system"), "{message}");
    for (arguments, part) in [
        (["--tolerance", "9"], "--tolerance: must be from 0 to 1.6 m"),
        (["--certainty", "0.4"], "--certainty: must be above 0.5"),
        (["--list", "a.txt"], "--list: a.txt: a list of changes is .csv, .json or .geojson"),
        (["-o", "a.pcd"], "--output: a.pcd: voxels with classes are .las .laz"),
    ] {
        let (code, message) = failure(&[&["compare", text(&map), text(&map)][..], &arguments].concat());
        assert!(code == 2 && message.contains(part), "{message}");
    }
    voxtile(&["compare", text(&map), "missing"]).assert().failure();
}

#[test]
fn hidden_voxels_are_told_from_those_out_of_view() {
    let folder = TempDir::new().unwrap();
    let path = |name: &str| folder.path().join(name);
    let far = wall_at(folder.path(), "far", 4.05, 0.1, None);
    let near = wall_at(folder.path(), "near", 2.05, 0.1, None);
    let (poses, page, csv) = (path("poses.txt"), path("page.html"), path("all.csv"));
    fs::write(&poses, "1 0 0 0 0 1 0 0 0 0 1 0\n").unwrap();
    let run = |more: &[&str]| json(&[&["compare", text(&far), text(&near), "--json"][..], more].concat());
    let counts = |found: &serde_json::Value| {
        [&found["before"]["not_seen"], &found["before"]["hidden"], &found["after"]["hidden"]]
            .map(Clone::clone)
    };
    let unknown = serde_json::Value::Null;
    assert_eq!(counts(&run(&[])), [25.into(), unknown.clone(), unknown.clone()]);
    // The near wall was in front of the far one.
    let files = ["--report", text(&page), "-o", text(&csv), "--all"];
    let found = run(&[&["--poses-after", text(&poses)][..], &files].concat());
    assert_eq!(counts(&found), [25.into(), 25.into(), unknown]);
    assert!(fs::read_to_string(&csv).unwrap().lines().filter(|line| line.contains(",72")).count() == 25);
    let page = fs::read_to_string(&page).unwrap();
    let row = "hidden after</td><td>earlier map</td><td>had something in front of the place</td><td class=\"number\">25<";
    assert!(page.contains(row) && !page.contains("hidden before"), "{page}");
    let summary = output(&["compare", text(&far), text(&near), "--poses-after", text(&poses)]);
    assert!(summary.contains("  hidden            25 100.0 %             unknown"), "{summary}");
    // From the side, nothing was.
    fs::write(&poses, "1 0 0 3.05 0 1 0 0 0 0 1 0\n").unwrap();
    assert_eq!(run(&["--poses-after", text(&poses)])["before"]["hidden"], 0);
    fs::write(&poses, "").unwrap();
    let (code, message) = failure(&["compare", text(&far), text(&near), "--poses-after", text(&poses)]);
    assert!(code == 2 && message.contains("poses.txt: contains no pose"), "{message}");
    // Positions of kept scans.
    let input = scans(&folder);
    for (map, more) in [("kept", "--keep-scans"), ("other", "--keep-scans")] {
        output(&["build", text(&input), "-o", text(&path(map)), more]);
    }
    let found = json(&["compare", text(&path("kept")), text(&path("other")), "--json"]);
    assert!(found["before"]["hidden"] == 0 && found["after"]["hidden"] == 0, "{found}");
}

#[test]
fn frontiers_are_listed() {
    let folder = TempDir::new().unwrap();
    let map = wall_at(folder.path(), "map", 2.05, 0.1, None);
    let region = ["--region", "0", "-0.2", "-0.2", "2.1", "0.3", "0.3"];
    let found = json(&[&["coverage", text(&map), "--json"][..], &region].concat());
    let share = found["observed_share"].as_f64().unwrap();
    assert!(found["occupied"] == 25 && (0.2..1.0).contains(&share), "{found}");
    assert_eq!(found["frontiers"].as_array().unwrap().len(), 1, "{found}");
    assert!(found["frontiers"][0]["area_m2"].as_f64().unwrap() > 0.5, "{found}");
    let summary = output(&["coverage", text(&map)]);
    assert!(summary.contains("observed  25 occupied voxels") && summary.contains("1 frontier,"), "{summary}");
    // Six scans from the origin hit each voxel.
    assert!(summary.contains("times     from 1 0.0 %, from 2 0.0 %, from 4 100.0 %\n"), "{summary}");
    assert!(!summary.contains("distance"), "{summary}");
    let poses = folder.path().join("poses.txt");
    fs::write(&poses, "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 -9 0 1 0 0 0 0 1 0\n").unwrap();
    let found = json(&["coverage", text(&map), "--poses", text(&poses), "--json"]);
    let classes = serde_json::json!(
        [0.0, 1.0, 2.0]
            .map(|from| { serde_json::json!({ "from": from, "voxels": if from == 2.0 { 25 } else { 0 } }) })
    );
    assert_eq!(found["observations"]["distances_m"], classes, "{found}");
    let summary = output(&["coverage", text(&map), "--poses", text(&poses)]);
    assert!(summary.contains("distance  from 0 m 0.0 %, from 1 m 0.0 %, from 2 m 100.0 %\n"), "{summary}");
}

/// Makes a map of a floor of 2 x 2 m seen from above, with a heap of one square metre.
fn site(folder: &Path, name: &str, heap_m: f64) -> PathBuf {
    let map = folder.join(name);
    let config = MapConfig::new(0.1, 10.0).unwrap();
    let mut mapper = MapOptions::new().config(config).create_new(true).open(&map).unwrap();
    for (x, y) in (0..20).flat_map(|x| (0..20).map(move |y| (x, y))) {
        let z = if x < 10 && y < 10 { heap_m } else { 0.0 };
        let [x, y, z] = [f64::from(x) * 0.1, f64::from(y) * 0.1, z].map(|k| k + 0.05);
        mapper
            .insert_scan(&Scan { origin: [x, y, 4.0], points: vec![[x, y, z]], ..Scan::default() })
            .unwrap();
    }
    mapper.flush().unwrap();
    map
}

#[test]
fn volumes_between_maps_and_over_planes_are_printed() {
    let folder = TempDir::new().unwrap();
    let (before, after) = (site(folder.path(), "before", 0.0), site(folder.path(), "after", 1.5));
    let near = |value: &serde_json::Value, wanted: f64| (value.as_f64().unwrap() - wanted).abs() < 1e-9;
    let found = json(&["volume", text(&before), text(&after), "--json"]);
    let measured = &found["measured"];
    assert!(near(&measured["fill_m3"], 1.5) && near(&measured["cut_m3"], 0.0), "{found}");
    assert!(near(&measured["area_m2"], 4.0) && near(&found["measured_share"], 1.0), "{found}");
    assert_eq!((&found["after"], &found["plane_m"]), (&text(&after).into(), &serde_json::Value::Null));
    let back = json(&["volume", text(&after), text(&before), "--json"]);
    assert!(near(&back["measured"]["cut_m3"], 1.5) && near(&back["measured"]["net_m3"], -1.5), "{back}");
    let plane = json(&["volume", text(&after), "--plane", "-0.95", "--json"]);
    assert!(near(&plane["measured"]["fill_m3"], 4.0 + 1.5), "{plane}");
    let polygon = folder.path().join("half.geojson");
    fs::write(&polygon, r#"{"type":"Polygon","coordinates":[[[0,0],[0.5,0],[0.5,1],[0,1],[0,0]]]}"#).unwrap();
    let part = json(&["volume", text(&before), text(&after), "--polygon", text(&polygon), "--json"]);
    assert!(near(&part["measured"]["fill_m3"], 0.75) && near(&part["area_m2"], 0.5), "{part}");
    let printed = output(&["volume", text(&before), text(&after), "--region", "0", "0", "-1", "4", "1", "3"]);
    for line in ["measured             2.00        1.500        0.000       +1.500", "4.00, 50.0 % measured"]
    {
        assert!(printed.contains(line), "{printed}");
    }
    assert!(failure(&["volume", text(&before)]).1.contains("--plane"));
    assert!(failure(&["volume", text(&before), "--plane", "nan"]).1.contains("finite height"));
    assert!(failure(&["volume", text(&before), text(&after), "--least", "-1"]).1.contains("least"));
}

/// Returns the pictures of a page, as width, height and RGB.
fn pictures_of(page: &str) -> Vec<(usize, usize, Vec<u8>)> {
    let pictures = page.split("src=\"data:image/png;base64,").skip(1);
    pictures
        .map(|rest| {
            let data = rest.split('"').next().unwrap();
            let png = base64::Engine::decode(&base64::engine::general_purpose::STANDARD, data).unwrap();
            let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
            let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
            let info = reader.next_frame(&mut pixels).unwrap();
            (info.width as usize, info.height as usize, pixels)
        })
        .collect()
}

fn pixels_of(picture: &(usize, usize, Vec<u8>), color: [u8; 3]) -> usize {
    picture.2.chunks_exact(3).filter(|pixel| **pixel == color).count()
}

#[test]
fn a_page_has_the_counts_and_shows_the_changes() {
    use voxtile_render::colors::{APPEARED, NOT_SEEN, UNCERTAIN, VANISHED};
    let folder = TempDir::new().unwrap();
    let before = wall_at(folder.path(), "<b>mon & \"tue\"", 2.05, 0.1, None);
    let after = wall_at(folder.path(), "after", 4.05, 0.1, None);
    let path = folder.path().join("page.html");
    let found = json(&["compare", text(&before), text(&after), "--report", text(&path), "--json"]);
    assert_eq!(found["report"], text(&path));
    let page = fs::read_to_string(&path).unwrap();
    assert!(page.contains("<h1>&lt;b&gt;mon &amp; &quot;tue&quot; → after</h1>") && !page.contains("<b>mon"));
    for row in [
        "vanished</td><td>earlier map</td><td>has seen the place free</td><td class=\"number\">9</td>\
         <td class=\"number\">0.009</td><td class=\"number\">36.0 %</td>",
        "uncertain vanished</td><td>earlier map</td><td>has perhaps seen the place free</td>\
         <td class=\"number\">16</td>",
        "not seen before</td><td>later map</td><td>has not observed the place</td><td class=\"number\">25</td>",
        "appeared</td><td>later map</td><td>has seen the place free</td><td class=\"number\">0</td>",
        "vanished</td><td class=\"number\">2.05 0.05 0.05</td><td class=\"number\">0.10 x 0.30 x 0.30</td>\
         <td class=\"number\">0.009</td><td class=\"number\">9</td></tr>",
        "<th>tolerance</th><td>1 voxel (0.100 m)</td>",
        "<th>certainty</th><td>probability 0.7</td>",
    ] {
        assert!(page.contains(row), "{row} is missing in {page}");
    }
    assert!(page.contains("x 2.00 to 4.10 m, y -0.30 to 0.50 m"), "{page}");
    // The overview, and the change from above and from the side, along the wall: 3 x 1 and 3 x 3 voxels.
    let [overview, above, side] = &pictures_of(&page)[..] else { panic!("not three pictures: {page}") };
    // Nothing appeared, so the color is that of the legend only.
    let in_legend = pixels_of(overview, APPEARED);
    assert!(in_legend > 0);
    for color in [VANISHED, UNCERTAIN, NOT_SEEN] {
        assert!(pixels_of(overview, color) > in_legend + 100, "{color:?}");
    }
    let cell = |picture: &(usize, usize, Vec<u8>), cells: usize| {
        let edge = (pixels_of(picture, VANISHED) as f64 / cells as f64).sqrt();
        assert!(edge.fract() == 0.0 && edge >= 16.0, "{edge}");
        edge as usize
    };
    let edge = cell(above, 3);
    cell(side, 9);
    // From above, the five rows of the earlier wall are uncertain, three vanished, uncertain.
    let at = |y: usize| {
        let pixel = 3 * (above.0 / 2 + above.0 * (edge / 2 + edge * y));
        <[u8; 3]>::try_from(&above.2[pixel..pixel + 3]).unwrap()
    };
    assert_eq!((above.0, above.1), (edge, 5 * edge));
    assert_eq!([0, 1, 2, 3, 4].map(at), [UNCERTAIN, VANISHED, VANISHED, VANISHED, UNCERTAIN]);
}

#[test]
fn a_page_of_maps_without_common_space_begins_with_the_warning() {
    let folder = TempDir::new().unwrap();
    let [near, far] = ["near", "far"].map(|name| folder.path().join(name));
    let whole = wall_at(folder.path(), "whole", 60.05, 0.1, None);
    for (part, [from, to]) in [(&near, ["0", "9"]), (&far, ["50", "70"])] {
        output(&["crop", text(&whole), "-o", text(part), "--region", from, "-1", "-1", to, "1", "1"]);
    }
    let path = folder.path().join("page.html");
    let summary = output(&["compare", text(&near), text(&far), "--report", text(&path)]);
    assert!(summary.contains(&format!("wrote     {}", path.display())), "{summary}");
    let page = fs::read_to_string(&path).unwrap();
    let [warning, note, numbers] = [
        "have no place in common",
        "There is no picture: the maps have no occupied voxels in a common place",
        "<h2>Occupied voxels",
    ]
    .map(|part| page.find(part).unwrap_or_else(|| panic!("{part}: {page}")));
    assert!(warning < note && note < numbers, "{page}");
    assert!(
        pictures_of(&page).is_empty() && page.contains("No cluster of changed voxels has 8 voxels or more")
    );
    for (file, part) in [("-", "--report: needs a file"), ("missing/page.html", "missing")] {
        let (code, message) = failure(&["compare", text(&near), text(&far), "--report", file]);
        assert!(code != 0 && message.contains(part), "{message}");
    }
}
