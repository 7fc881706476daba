use super::cli::{failure, json, output, text};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Builds a map with one obstacle at (0.55, 0.05, 0.05) m.
fn one_obstacle(folder: &TempDir) -> PathBuf {
    let (points, map) = (folder.path().join("points.xyz"), folder.path().join("map"));
    fs::write(&points, "0.55 0.05 0.05\n").unwrap();
    let options = ["--no-rays", "--poses", "identity", "--resolution", "0.1", "--tile-size", "1"];
    output(&[&["build", text(&points), "-o", text(&map)][..], &options].concat());
    map
}

/// Pixels of a 16-bit grey PNG, from the top.
fn pixels(path: &Path) -> (u32, Vec<u16>) {
    let mut reader =
        png::Decoder::new(std::io::BufReader::new(fs::File::open(path).unwrap())).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.color_type, info.bit_depth), (png::ColorType::Grayscale, png::BitDepth::Sixteen));
    (info.width, bytes.chunks_exact(2).map(|pair| u16::from_be_bytes([pair[0], pair[1]])).collect())
}

#[test]
fn a_field_is_computed_updated_and_written_to_files() {
    let folder = TempDir::new().unwrap();
    let map = one_obstacle(&folder);
    let path = |name: &str| folder.path().join(name);
    let (field, png, npz) = (path("field"), path("slice.png"), path("field.npz"));
    let run = |more: &[&str]| {
        let common = ["distance", text(&map), "--max-distance", "0.5", "--unknown", "free", "--json"];
        json(&[&common[..], more].concat())
    };
    let first = run(&["-o", text(&field)]);
    assert_eq!((&first["tiles"], &first["tiles_computed"]), (&27.into(), &27.into()), "{first}");
    assert!(first["has_obstacles"] == true && first["max_distance_m"] == 0.5 && first["unknown"] == "free");
    let files = ["--npz", text(&npz), "--png", text(&png), "--slice-z", "0.05"];
    let region = ["--region", "0", "0", "0", "1.2", "0.3", "0.2"];
    let again = run(&[&["-o", text(&field)][..], &files].concat());
    assert_eq!((&again["tiles_kept"], &again["tiles_computed"]), (&27.into(), &0.into()), "{again}");
    let (width, of_field) = pixels(&png);
    assert_eq!((width, of_field.len()), (10, 100));
    // The last row is that of the lowest y, with the obstacle.
    assert_eq!(&of_field[90..], [500, 400, 300, 200, 100, 0, 100, 200, 300, 400]);
    assert_eq!(of_field[80], 65534, "{of_field:?}");
    // Without a folder, of a box.
    run(&[&files[..], &region].concat());
    let (width, of_box) = pixels(&png);
    assert_eq!((width, of_box.len()), (12, 36));
    assert_eq!(&of_box[24..], [500, 400, 300, 200, 100, 0, 100, 200, 300, 400, 500, 65534]);
    let archive = fs::read(&npz).unwrap();
    for name in ["distance.npy", "squared_voxels.npy", "origin.npy", "resolution.npy", "max_distance.npy"] {
        assert!(archive.windows(name.len()).any(|bytes| bytes == name.as_bytes()), "{name}");
    }
    let shape = b"'shape': (2, 3, 12, )";
    assert!(archive.windows(shape.len()).any(|bytes| bytes == shape));
    let picture = path("picture.png");
    let slice = ["--distance-slice", "0.05", "--max-distance", "0.5"];
    let drawn = json(&[&["picture", text(&map), "-o", text(&picture), "--json"][..], &slice].concat());
    assert!(drawn["color"] == "distance" && drawn["range"][1] == 0.5 && drawn["solid_cells"] == 1, "{drawn}");
    let printed = output(&["distance", text(&map), "-o", text(&path("other")), "--max-distance", "0.3"]);
    assert!(printed.starts_with("field     1 tile in "), "{printed}");
}

#[test]
fn wrong_arguments_of_distances_are_refused() {
    let folder = TempDir::new().unwrap();
    let map = one_obstacle(&folder);
    let field = folder.path().join("field");
    let refused = |more: &[&str]| {
        let (code, message) = failure(&[&["distance", text(&map)][..], more].concat());
        assert_eq!(code, 2, "{message}");
        message
    };
    for cap in ["0", "nan", "-1", "20"] {
        let message = refused(&["-o", text(&field), "--max-distance", cap]);
        assert!(
            message.contains("--max-distance: ") && message.contains("from 0.1 m to 18.1 m"),
            "{message}"
        );
        assert!(!field.exists());
    }
    assert!(refused(&[]).contains("--output"));
    assert!(refused(&["--png", "a.png"]).contains("--slice-z"));
    assert!(refused(&["-o", text(&map.join("field"))]).contains("inside the map"));
    assert!(refused(&["-o", text(folder.path())]).contains("empty folder"));
    assert!(
        refused(&["-o", text(&field), "--region", "0.01", "0.01", "0.01", "0.02", "0.02", "0.02"])
            .contains("no center")
    );
}
