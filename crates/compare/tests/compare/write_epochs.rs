//! The simulated epochs as files, for `tools/m3c2/run.sh`.

use crate::epochs::{SCANS, Setting, large_things, walk};
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use voxtile::{Point, Scan};
use voxtile_simulation::Solid;

#[test]
#[ignore = "writes files for tools/m3c2/run.sh into VOXTILE_EPOCHS"]
fn epochs_are_written_as_scans() {
    let folder = std::env::var_os("VOXTILE_EPOCHS").expect("set VOXTILE_EPOCHS to a new folder");
    for (name, setting) in [
        ("cubes_0.3", Setting::of_cubes(3, 0)),
        ("cubes_0.5", Setting::of_cubes(5, 0)),
        ("cubes_0.8", Setting::of_cubes(8, 0)),
        ("screens", large_things()),
        ("panel_0.03", moved_panel()),
    ] {
        let scene = Path::new(&folder).join(name);
        for (epoch, name) in [(0, "before"), (1, "after")] {
            write_scans(&scene.join(name), walk(&setting.of_epoch(epoch), SCANS, epoch, 0.0));
        }
        let mut things = BufWriter::new(File::create(scene.join("things.csv")).unwrap());
        writeln!(things, "kind,x0,y0,z0,x1,y1,z1").unwrap();
        for (kind, solids) in
            [("stays", &setting.stays), ("vanished", &setting.vanishes), ("appeared", &setting.appears)]
        {
            for Solid { bounds, .. } in solids {
                let [x0, y0, z0] = bounds.min;
                let [x1, y1, z1] = bounds.max;
                writeln!(things, "{kind},{x0},{y0},{z0},{x1},{y1},{z1}").unwrap();
            }
        }
        things.flush().unwrap();
    }
}

/// A panel that moves by 3 cm, less than a voxel.
fn moved_panel() -> Setting {
    let panel = |y: f64| vec![Solid::new([6.0, y, 0.0], [10.0, y + 0.1, 2.5], 0.6)];
    Setting { stays: Vec::new(), vanishes: panel(8.0), appears: panel(8.03) }
}

/// Writes scans as a folder of PCD files with a file of poses.
fn write_scans(folder: &Path, scans: impl Iterator<Item = Scan>) {
    fs::create_dir_all(folder).unwrap();
    let mut poses = BufWriter::new(File::create(folder.join("poses_tum.txt")).unwrap());
    for (number, scan) in scans.enumerate() {
        let [x, y, z] = scan.origin;
        writeln!(poses, "{number} {x} {y} {z} 0 0 0 1").unwrap();
        let mut cloud = BufWriter::new(File::create(folder.join(format!("{number:06}.pcd"))).unwrap());
        let points = scan.points.len();
        write!(
            cloud,
            "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {points}\nHEIGHT 1\n\
             VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA binary\n"
        )
        .unwrap();
        for point in &scan.points {
            let of_sensor: Point = std::array::from_fn(|k| point[k] - scan.origin[k]);
            of_sensor.iter().for_each(|k| cloud.write_all(&(*k as f32).to_le_bytes()).unwrap());
        }
        cloud.flush().unwrap();
    }
    poses.flush().unwrap();
}
