//! Checks views from a direction between above and the side.

use std::collections::HashSet;
use voxtile::mapper::MapView;
use voxtile::scan::PointBatch;
use voxtile::space::{Aabb, Point};
use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan, VoxelIndex};
use voxtile_render::{Background, ColorBy, Drawn, Picture, View, colors};

const RESOLUTION_M: f64 = 0.5;

fn center(voxel: VoxelIndex) -> Point {
    voxel.map(|index| (f64::from(index) + 0.5) * RESOLUTION_M)
}

fn map_of(voxels: &[VoxelIndex]) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap()).unwrap();
    let points: Vec<Point> = voxels.iter().copied().map(center).collect();
    let is_occupied = vec![true; points.len()];
    map.batch_update(&PointBatch { points: &points, intensities: None, is_occupied: &is_occupied }).unwrap();
    map
}

fn plain(azimuth_deg: f64, elevation_deg: f64) -> Picture {
    let view = View::Oblique { azimuth_deg, elevation_deg };
    Picture::new().with_view(view).with_legend(false).with_grid(false).with_size_px([400; 2])
}

fn draw(picture: &Picture, map: &dyn MapView) -> Drawn {
    picture.draw(map, |_, _| {}).unwrap()
}

/// A floor with a wall, a table and some noise.
fn room() -> Vec<VoxelIndex> {
    let floor = (0..20).flat_map(|x| (0..14).map(move |y| [x, y, 0]));
    let wall = (0..20).flat_map(|x| (1..6).map(move |z| [x, 13, z]));
    let table = (4..9).flat_map(|x| (4..8).map(move |y| [x, y, 3]));
    floor.chain(wall).chain(table).chain([[15, 2, 5], [1, 12, 9]]).collect()
}

/// Returns the hue of a color: the shares of its channels, which shades keep.
fn hue(color: [u8; 3]) -> [f64; 3] {
    let sum = color.iter().map(|&k| f64::from(k)).sum::<f64>().max(1.0);
    color.map(|k| f64::from(k) / sum)
}

#[test]
fn pixels_have_the_heights_of_the_first_voxel_on_their_line_of_sight() {
    let voxels = room();
    let map = map_of(&voxels);
    let set: HashSet<VoxelIndex> = voxels.iter().copied().collect();
    for (azimuth, elevation) in [(-60.0, 40.0), (-120.0, 15.0), (20.0, 75.0)] {
        // The region keeps all voxels in the picture, whose middle is then that of the voxels.
        let region = Aabb { min: [-9.0; 3], max: [99.0; 3] };
        let drawn = draw(&plain(azimuth, elevation).with_region(region), &map);
        let ((sin, cos), (rise, run)) =
            (f64::to_radians(azimuth).sin_cos(), f64::to_radians(elevation).sin_cos());
        let axes = [[-sin, cos, 0.0], [-rise * cos, -rise * sin, run], [run * cos, run * sin, rise]];
        let along = |k: usize, at: [f64; 3]| (0..3).map(|j| axes[k][j] * at[j]).sum::<f64>();
        let corners = |k: usize| {
            let half = 0.5 * axes[k].iter().map(|j| j.abs()).sum::<f64>();
            let middles = voxels.iter().map(|voxel| along(k, voxel.map(|j| f64::from(j) + 0.5)));
            let all: Vec<f64> = middles.collect();
            [
                all.iter().copied().fold(f64::MAX, f64::min) - half,
                all.iter().copied().fold(f64::MIN, f64::max) + half,
            ]
        };
        let (across, up) = (corners(0), corners(1));
        let image = &drawn.image;
        let size = [image.width_px(), image.height_px()];
        // The size of a voxel follows from the width of the picture, but for the rounding of the bounds.
        let margin = 0.03 * (across[1] - across[0]).max(up[1] - up[0]);
        let zoom =
            (400.0 / (across[1] - across[0] + 2.0 * margin)).min(400.0 / (up[1] - up[0] + 2.0 * margin));
        let (mut same, mut all) = (0, 0);
        for y in (0..size[1]).step_by(7) {
            for x in (0..size[0]).step_by(7) {
                let right = across[0] - margin + (x as f64 + 0.5) / zoom;
                let rising = up[1] + margin - (y as f64 + 0.5) / zoom;
                let found = (0..3_500).map(|step| 35.0 - f64::from(step) * 0.02).find_map(|near| {
                    let at: VoxelIndex = std::array::from_fn(|k| {
                        (right * axes[0][k] + rising * axes[1][k] + near * axes[2][k]).floor() as i32
                    });
                    set.contains(&at).then_some(at)
                });
                let color = image.pixel(x, y).unwrap();
                let is_same = match found {
                    None => color == colors::UNKNOWN,
                    Some(voxel) => {
                        let [low, high] = drawn.range.unwrap();
                        let share = (center(voxel)[2] - low) / (high - low);
                        let (found, wanted) = (hue(color), hue(colors::color_of(share)));
                        (0..3).all(|k| (found[k] - wanted[k]).abs() < 0.05)
                    }
                };
                same += u32::from(is_same);
                all += 1;
            }
        }
        // Pixels at edges are mixed.
        assert!(f64::from(same) > 0.93 * f64::from(all), "{same} of {all} from {azimuth}, {elevation}");
    }
}

#[test]
fn the_faces_of_a_cube_differ_in_brightness() {
    let drawn = draw(&plain(-45.0, 35.0), &map_of(&[[0, 0, 0]]));
    let [width, height] = [drawn.image.width_px(), drawn.image.height_px()];
    let brightness =
        |x: usize, y: usize| drawn.image.pixel(x, y).unwrap().iter().map(|&k| u32::from(k)).sum::<u32>();
    let [top, left, right] =
        [[width / 2, height / 4], [width / 3, 2 * height / 3], [2 * width / 3, 2 * height / 3]]
            .map(|[x, y]| brightness(x, y));
    assert!(top > left && left > right && right > 60, "{top} {left} {right}");
}

/// Returns a map of scattered scans over many tiles.
fn survey_map() -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(0.2, 2.0).unwrap().with_range(0.0, 30.0)).unwrap();
    for scan in 0..6 {
        let angle = |k: i32| f64::from(k) * 0.7 + f64::from(scan);
        let points = (0..400).map(|k| {
            let far = 4.0 + f64::from(k % 37) * 0.5;
            [far * angle(k).cos(), far * angle(k).sin(), f64::from(k % 11) * 0.3]
        });
        let origin = [f64::from(scan), 0.0, 1.0];
        map.insert_scan(&Scan { origin, points: points.collect(), intensities: None }).unwrap();
    }
    map
}

#[test]
fn the_picture_does_not_depend_on_threads() {
    let map = survey_map();
    let path = (0..6).map(|x| [f64::from(x), 0.0, 1.0]).collect();
    let view = View::Oblique { azimuth_deg: 30.0, elevation_deg: 25.0 };
    let picture = Picture::new().with_view(view).with_size_px([700; 2]).with_path(path).with_title("a map");
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            [ColorBy::Height, ColorBy::Count]
                .map(|color| draw(&picture.clone().with_color(color), &map).image)
        })
    };
    assert_eq!(with_threads(1), with_threads(5));
}

#[test]
fn small_voxels_cover_as_many_pixels_as_their_surface() {
    // A floor of 300 x 200 voxels in a small picture, and then from the side.
    let floor: Vec<VoxelIndex> = (0..300).flat_map(|x| (0..200).map(move |y| [x, y, 0])).collect();
    let map = map_of(&floor);
    for elevation in [90.0, 45.0, 20.0] {
        let drawn = draw(&plain(-90.0, elevation).with_size_px([150; 2]), &map);
        let [_, _, width, _] = drawn.map_px;
        // 300 voxels and a margin of 3 % on both sides, of which 0.5 % of the voxels may be cut off.
        let zoom = width as f64 / (300.0 * 1.06);
        let (rise, run) = f64::to_radians(elevation).sin_cos();
        let wanted = 4.0 * zoom * zoom * 300.0 * (200.0 * rise + run);
        let found = drawn.solid_cells as f64;
        assert!((found / wanted - 1.0).abs() < 0.06, "{found} for {wanted} from {elevation}");
    }
}

#[test]
fn any_map_has_an_oblique_picture() {
    let nothing = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    let far = map_of(&[[0; 3], [2_000_000_000, 0, 7]]);
    for map in [&nothing, &map_of(&[[-70_000, 9, 4]]), &far] {
        for (azimuth, elevation) in [(0.0, 0.0), (-60.0, 40.0), (1e9, 90.0)] {
            for legend in [false, true] {
                let picture = plain(azimuth, elevation).with_legend(legend).with_grid(true);
                let drawn =
                    draw(&picture.with_path(vec![[f64::NAN; 3], [0.0; 3], [1e300; 3], [-1e9; 3]]), map);
                assert!(drawn.image.width_px() > 0 && drawn.image.height_px() < 3000);
            }
        }
    }
    assert_eq!(draw(&plain(-60.0, 40.0), &nothing).solid_cells, 0);
    // Both ends of the world.
    assert!(draw(&plain(-60.0, 40.0), &far).solid_cells >= 2);
    for (azimuth, elevation) in [(f64::NAN, 40.0), (0.0, -1.0), (0.0, 91.0), (0.0, f64::NAN)] {
        let error = plain(azimuth, elevation).draw(&nothing, |_, _| {}).unwrap_err();
        assert_eq!(error.kind(), "invalid_argument");
    }
    let error = plain(-60.0, 40.0).start(&nothing, |_, _| {}).err().unwrap();
    assert_eq!(error.kind(), "invalid_argument");
}

#[test]
fn only_the_map_covers_a_transparent_background() {
    let picture = plain(-60.0, 40.0).with_background(Background::Transparent);
    let drawn = draw(&picture, &map_of(&room()));
    let alphas: Vec<u8> = drawn.image.rgba().chunks(4).map(|pixel| pixel[3]).collect();
    let count = |alpha: u8| alphas.iter().filter(|&&found| found == alpha).count();
    assert!(count(0) > 10_000 && count(255) > 10_000);
    // Edges are smooth.
    assert!(count(128) > 100);
}
