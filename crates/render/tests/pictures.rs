//! Checks pictures of known maps pixel by pixel, and counts of maps.

use std::sync::Mutex;
use voxtile::mapper::{MapStatistics, MapView, TileRef};
use voxtile::scan::PointBatch;
use voxtile::space::{Aabb, Point, TileBox};
use voxtile::{InMemoryMapper, MapConfig, Mapper, Result, Scan, TileIndex};
use voxtile_distance::DistanceOptions;
use voxtile_render::{Background, ColorBy, Drawn, Image, Picture, SideAxis, Survey, View, colors};

const RESOLUTION_M: f64 = 0.5;

/// Returns a map with these occupied and free voxels, by their centers.
fn map_of(occupied: &[Point], free: &[Point]) -> InMemoryMapper {
    let mut map = InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap()).unwrap();
    for (points, is_occupied) in [(occupied, true), (free, false)] {
        let is_occupied = vec![is_occupied; points.len()];
        map.batch_update(&PointBatch { points, intensities: None, is_occupied: &is_occupied }).unwrap();
    }
    map
}

/// Returns a wall of 12 voxels along x and 4 along z, with a free voxel in front of each end.
fn wall() -> InMemoryMapper {
    let mut wall = Vec::new();
    for x in 0..12 {
        for z in 0..4 {
            wall.push(center([x, 3, z]));
        }
    }
    map_of(&wall, &[center([0, 0, 0]), center([11, 0, 0])])
}

fn center(voxel: [i32; 3]) -> Point {
    voxel.map(|index| (f64::from(index) + 0.5) * RESOLUTION_M)
}

/// Options for one pixel per cell: no margin, no grid.
fn plain() -> Picture {
    Picture::new().with_legend(false).with_grid(false).with_size_px([240; 2])
}

fn draw(picture: &Picture, map: &impl MapView) -> Drawn {
    picture.draw(map, |_, _| {}).unwrap()
}

/// Returns the color at the center of a cell, numbered from the lower left.
fn cell(drawn: &Drawn, [across, up]: [usize; 2]) -> [u8; 3] {
    let [left, top, _, height] = drawn.map_px;
    let half = drawn.cell_px / 2;
    drawn
        .image
        .pixel(left + across * drawn.cell_px + half, top + height - 1 - up * drawn.cell_px - half)
        .unwrap()
}

#[test]
fn a_wall_from_above_has_the_right_cells() {
    let drawn = draw(&plain(), &wall());
    assert_eq!((drawn.cell_px, drawn.cell_m), (20, RESOLUTION_M));
    assert_eq!(drawn.region_m.unwrap().max[..2], [6.0, 2.0]);
    assert_eq!((drawn.image.width_px(), drawn.image.height_px()), (240, 80));
    assert_eq!((drawn.solid_cells, drawn.known_cells), (12, 14));
    for x in 0..12 {
        // A single height has the lowest color.
        assert_eq!(cell(&drawn, [x, 3]), colors::color_of(0.0), "{x}");
        let below = if x == 0 || x == 11 { colors::FREE } else { colors::UNKNOWN };
        assert_eq!(cell(&drawn, [x, 0]), below, "{x}");
        assert_eq!(cell(&drawn, [x, 1]), colors::UNKNOWN);
    }
}

#[test]
fn a_wall_from_the_side_rises_in_color() {
    let drawn = draw(&plain().with_view(View::Side(SideAxis::X)), &wall());
    assert_eq!((drawn.image.width_px(), drawn.image.height_px()), (240, 80));
    assert_eq!(drawn.range.unwrap(), [0.25, 1.75]);
    for z in 0..4 {
        assert_eq!(cell(&drawn, [5, z]), colors::color_of(z as f64 / 3.0), "{z}");
    }
    // From the other side the wall is a line, with free voxels next to it.
    let drawn = draw(&plain().with_view(View::Side(SideAxis::Y)), &wall());
    assert_eq!(cell(&drawn, [3, 3]), colors::color_of(1.0));
    assert_eq!(cell(&drawn, [0, 0]), colors::FREE);
    assert_eq!(cell(&drawn, [0, 1]), colors::UNKNOWN);
}

#[test]
fn a_slice_excludes_voxels_above_and_below() {
    let map = map_of(&[center([0, 0, 0]), center([1, 0, 1]), center([2, 0, 2]), center([3, 0, 3])], &[]);
    let known = |z_m, thickness_m| {
        let drawn = draw(&plain().with_view(View::Slice { z_m, thickness_m }), &map);
        let region = drawn.region_m.unwrap();
        (region.min[0], region.max[0])
    };
    assert_eq!(known(0.6, 0.0), (0.5, 1.0));
    assert_eq!(known(0.5, 0.0), (0.5, 1.0));
    assert_eq!(known(1.0, 1.0), (0.5, 1.5));
    let none = draw(&plain().with_view(View::Slice { z_m: 9.0, thickness_m: 0.0 }), &map);
    assert!(none.region_m.is_none() && none.solid_cells == 0);
    for view in [View::Slice { z_m: f64::NAN, thickness_m: 0.0 }, View::Slice { z_m: 0.0, thickness_m: -1.0 }]
    {
        let error = plain().with_view(view).draw(&map, |_, _| {}).unwrap_err();
        assert_eq!(error.kind(), "invalid_argument");
    }
}

#[test]
fn only_the_region_is_drawn() {
    let region = Aabb { min: [1.0, 1.5, 0.0], max: [2.5, 2.0, 0.5] };
    let drawn = draw(&plain().with_region(region), &wall());
    let drawn_region = drawn.region_m.unwrap();
    assert_eq!(
        (drawn_region.min[..2].to_vec(), drawn_region.max[..2].to_vec()),
        (vec![1.0, 1.5], vec![2.5, 2.0])
    );
    assert_eq!(drawn.solid_cells, 3);
    assert_eq!(drawn.range.unwrap()[0], 0.25);
}

#[test]
fn changes_have_their_own_colors() {
    let places: Vec<Point> = (0..3).map(|x| center([2 * x, 0, 0])).collect();
    let before = map_of(&places[..2], &[]);
    let after = map_of(&places[1..], &places[..1]);
    let drawn = plain().draw_difference(&before, &after, |_, _| {}).unwrap();
    let found = [0, 2, 4].map(|x| cell(&drawn, [x, 0]));
    assert_eq!(found, [colors::VANISHED, colors::SAME, colors::APPEARED]);
    let back = plain().draw_difference(&after, &before, |_, _| {}).unwrap();
    assert_eq!(cell(&back, [0, 0]), colors::APPEARED);
    let other = InMemoryMapper::new(MapConfig::new(0.25, 4.0).unwrap()).unwrap();
    let error = plain().draw_difference(&before, &other, |_, _| {}).unwrap_err().to_string();
    assert!(error.contains("0.25") && error.contains("0.5"), "{error}");
}

#[test]
fn the_trajectory_is_a_line() {
    let path = vec![center([1, 1, 0]), center([3, 1, 0]), center([5, 1, 0])];
    let drawn = draw(&plain().with_path(path), &wall());
    for x in 1..=5 {
        assert_eq!(cell(&drawn, [x, 1]), colors::PATH, "{x}");
    }
    assert_eq!(cell(&drawn, [6, 1]), colors::UNKNOWN);
    // Positions outside and invalid ones are skipped.
    let stray = vec![[f64::NAN; 3], [1e300; 3], [-1e9, 0.0, 0.0], [f64::INFINITY, 1.0, 1.0]];
    let stray = draw(&plain().with_path(stray), &wall());
    assert_eq!(stray.image, draw(&plain(), &wall()).image);
}

#[test]
fn probability_and_count_have_their_own_scales() {
    let twice = [center([0, 0, 0]), center([0, 0, 0]), center([1, 0, 0])];
    let map = map_of(&twice, &[]);
    let drawn = draw(&plain().with_color(ColorBy::Probability), &map);
    assert_eq!(drawn.range.unwrap(), [0.5, 1.0]);
    let [often, once] = [0, 1].map(|x| cell(&drawn, [x, 0]));
    assert_ne!(often, once);
    let drawn = draw(&plain().with_color(ColorBy::Count), &map);
    assert_eq!(drawn.range.unwrap(), [1.0, 2.0]);
    assert_eq!([0, 1].map(|x| cell(&drawn, [x, 0])), [colors::color_of(1.0), colors::color_of(0.0)]);
}

#[test]
fn any_map_has_a_picture() {
    let nothing = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    let one = map_of(&[center([-70_000, 9, 4])], &[]);
    let far = map_of(&[center([0; 3]), center([2_000_000_000, 0, 7])], &[]);
    for picture in [Picture::new(), plain(), Picture::new().with_size_px([0; 2])] {
        for map in [&nothing, &one, &far] {
            let Drawn { image, .. } = draw(&picture.clone().with_title("é <& 漢"), map);
            assert!(image.width_px() > 0 && image.width_px() < 3000 && image.height_px() < 3000);
            assert_eq!(image.rgba().len(), 4 * image.width_px() * image.height_px());
        }
    }
    assert_eq!(draw(&plain(), &one).solid_cells, 1);
    assert_eq!(draw(&plain(), &far).solid_cells, 2);
}

#[test]
fn single_rays_do_not_make_the_rest_small() {
    let mut voxels: Vec<Point> = (0..2_500).map(|k| center([k % 50, k / 50, 0])).collect();
    voxels.extend((0..10).map(|k| center([60 + 50 * k, 20, 0])));
    let map = map_of(&voxels, &[]);
    let plain = || plain().with_size_px([700; 2]);
    let drawn = draw(&plain(), &map);
    assert_eq!((drawn.region_m.unwrap().max[0], drawn.solid_cells), (25.0, 2_500));
    let all = Aabb { min: [-1e9; 3], max: [1e9; 3] };
    let whole = draw(&plain().with_region(all), &map);
    assert_eq!(whole.solid_cells, 2_510);
    let grown = plain().draw_difference(&map_of(&voxels[..2_500], &[]), &map, |_, _| {}).unwrap();
    assert_eq!(grown.solid_cells, 2_510);
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
    let with_threads = |threads: usize| -> Vec<Image> {
        let pool = rayon_pool(threads);
        pool.install(|| {
            let views = [View::Above, View::Side(SideAxis::X), View::Slice { z_m: 1.0, thickness_m: 0.5 }];
            let colors = [ColorBy::Height, ColorBy::Probability, ColorBy::Count];
            let pictures = views.into_iter().zip(colors).map(|(view, color)| {
                draw(&Picture::new().with_view(view).with_color(color).with_size_px([90; 2]), &map).image
            });
            pictures.collect()
        })
    };
    let one = with_threads(1);
    for threads in [2, 5, 16] {
        assert!(with_threads(threads) == one, "{threads} threads");
    }
}

fn rayon_pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

/// Map that counts the reads of its tiles.
struct Counting<'a> {
    map: &'a InMemoryMapper,
    reads: Mutex<u64>,
}

impl MapView for Counting<'_> {
    fn config(&self) -> &MapConfig {
        self.map.config()
    }
    fn scan_number(&self) -> u64 {
        self.map.scan_number()
    }
    fn tile_indices(&self) -> Vec<TileIndex> {
        self.map.tile_indices()
    }
    fn tile_bounds(&self) -> Option<TileBox> {
        self.map.tile_bounds()
    }
    fn has_tile(&self, index: TileIndex) -> bool {
        self.map.has_tile(index)
    }
    fn cached_tile_indices(&self) -> Vec<TileIndex> {
        Vec::new()
    }
    fn tile(&self, _: TileIndex) -> Result<Option<TileRef<'_>>> {
        panic!("a picture must not evict tiles from a cache")
    }
    fn tile_uncached(&self, index: TileIndex) -> Result<Option<TileRef<'_>>> {
        *self.reads.lock().unwrap() += 1;
        self.map.tile_uncached(index)
    }
    fn voxels_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        self.map.voxels_of_tile_hint(index)
    }
    fn last_scan_of_tile_hint(&self, index: TileIndex) -> Option<u64> {
        Some(index.to_array()[0].unsigned_abs().into())
    }
    fn statistics(&self) -> MapStatistics {
        MapStatistics::default()
    }
}

#[test]
fn tiles_outside_the_picture_are_not_read() {
    let map = survey_map();
    let counting = Counting { map: &map, reads: Mutex::new(0) };
    let region = Aabb { min: [0.1, 0.1, 0.1], max: [1.9, 1.9, 1.9] };
    let drawn = draw(&plain().with_region(region), &counting);
    assert_eq!((drawn.tiles, *counting.reads.lock().unwrap()), (1, 1));
    let by_scan = draw(&plain().with_color(ColorBy::LastScan), &counting);
    assert!(by_scan.range.unwrap()[1] > 1.0);
    let error = plain().with_color(ColorBy::LastScan).draw(&map, |_, _| {}).unwrap_err();
    assert!(error.to_string().contains("scan"), "{error}");
}

#[test]
fn a_survey_counts_the_content_of_a_map() {
    let map = survey_map();
    let survey = Survey::of(&map, |_, _| {}).unwrap();
    let (mut voxels, mut occupied, mut columns) = (0, 0, std::collections::BTreeSet::new());
    let threshold = map.config().occupied_log_odds();
    for tile in map.tiles() {
        for voxel in tile.unwrap().voxels() {
            voxels += 1;
            occupied += u64::from(voxel.evidence.log_odds >= threshold);
            columns.insert([voxel.index[0], voxel.index[1]]);
        }
    }
    assert_eq!((survey.voxels, survey.occupied, survey.columns), (voxels, occupied, columns.len() as u64));
    assert_eq!(survey.probabilities.iter().sum::<u64>(), voxels);
    assert_eq!(survey.heights.iter().map(|bin| bin.occupied).sum::<u64>(), occupied);
    assert!(survey.heights.windows(2).all(|pair| (pair[0].to_m - pair[1].from_m).abs() < 1e-9));
    assert!((survey.area_m2 - 0.04 * columns.len() as f64).abs() < 1e-6);
    let nothing = InMemoryMapper::new(MapConfig::new(0.1, 10.0).unwrap()).unwrap();
    assert_eq!(Survey::of(&nothing, |_, _| {}).unwrap(), Survey::default());
}

#[test]
fn moving_points_cover_the_map() {
    let at = |voxel: [i32; 3]| voxel.map(|index| (f64::from(index) + 0.9) * RESOLUTION_M);
    // Two points in one voxel, one over the wall, one beyond it, and invalid ones.
    let points =
        [at([2, 1, 0]), center([2, 1, 0]), at([5, 3, 9]), at([4, 3, 2]), at([-1, 1, 0]), [f64::NAN; 3]];
    let map = wall();
    let finish = |picture: &Picture, parts: &[&[Point]]| {
        let mut drawing = picture.start(&map, |_, _| {}).unwrap();
        parts.iter().for_each(|part| drawing.add_moving(part));
        drawing.finish()
    };
    let drawn = finish(&plain(), &[&points]);
    assert_eq!(drawn.moving_points, Some(3), "points above all tiles and outside do not count");
    for moving in [[2, 1], [4, 3]] {
        assert_eq!(cell(&drawn, moving), colors::MOVING, "{moving:?}");
    }
    assert_eq!(cell(&drawn, [5, 3]), colors::color_of(0.0));
    // The picture is the same if the points are added in several calls.
    let parts: Vec<&[Point]> = points.chunks(1).collect();
    assert_eq!(finish(&plain(), &parts).image, drawn.image);
    assert_eq!(draw(&plain(), &map).moving_points, None);

    let layer = plain().with_view(View::Slice { z_m: 1.25, thickness_m: 0.0 });
    let of_layer = finish(&layer, &[&points]);
    assert_eq!(of_layer.moving_points, Some(1));
    assert_eq!(cell(&of_layer, [4, 0]), colors::MOVING);
    let from_side = finish(&plain().with_view(View::Side(SideAxis::X)), &[&points]);
    assert_eq!((cell(&from_side, [2, 0]), cell(&from_side, [4, 2])), (colors::MOVING, colors::MOVING));
    let region = Aabb { min: [1.0, 0.0, 0.0], max: [2.0, 2.0, 2.0] };
    assert_eq!(finish(&plain().with_region(region), &[&points]).moving_points, Some(0));
    let options = plain();
    let mut difference = options.start_difference(&map, &map, |_, _| {}).unwrap();
    difference.add_moving(&points);
    assert_eq!(cell(&difference.finish(), [4, 3]), colors::MOVING);

    // The legend has one more line, also without points.
    let with_legend = Picture::new().with_grid(false);
    let (without, none) = (draw(&with_legend, &map), finish(&with_legend, &[&[]]));
    assert!(none.image.height_px() > without.image.height_px() && none.moving_points == Some(0));
    let count = |drawn: &Drawn| {
        let image = &drawn.image;
        let pixels = (0..image.height_px()).flat_map(|y| (0..image.width_px()).map(move |x| (x, y)));
        pixels.filter(|&(x, y)| image.pixel(x, y) == Some(colors::MOVING)).count()
    };
    assert_eq!(count(&without), 0);
    assert!(count(&none) > 0, "the swatch");
    let empty = InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap()).unwrap();
    let mut nothing = with_legend.start(&empty, |_, _| {}).unwrap();
    nothing.add_moving(&points);
    assert_eq!(nothing.finish().moving_points, Some(0));
}

#[test]
fn a_slice_of_distances_shows_free_voxels_by_distance_and_obstacles_light() {
    let row = |y: i32| (0..12).map(move |x| center([x, y, 0])).collect::<Vec<_>>();
    let map = map_of(&row(0), &[row(1), row(2), row(4)].concat());
    let mut picture = plain().with_view(View::Slice { z_m: 0.1, thickness_m: 0.0 });
    let options = DistanceOptions::new(1.0);
    let drawn = picture.start_distances(&map, options, |_, _| {}).unwrap().finish();
    assert_eq!((drawn.range, drawn.solid_cells, drawn.known_cells), (Some([0.0, 1.0]), 12, 48));
    let obstacle = cell(&drawn, [5, 0]);
    assert!(obstacle.iter().all(|part| *part > 200), "{obstacle:?}");
    assert_eq!(cell(&drawn, [5, 1]), colors::color_of(0.5));
    assert_eq!(cell(&drawn, [5, 2]), colors::color_of(1.0));
    assert_eq!(cell(&drawn, [5, 3]), colors::UNKNOWN);
    assert_eq!(cell(&drawn, [5, 4]), colors::color_of(1.0));
    assert!(plain().start_distances(&map, options, |_, _| {}).is_err());
    assert!(plain().with_color(ColorBy::Distance).draw(&map, |_, _| {}).is_err());
}

#[test]
fn classes_of_a_comparison_hide_each_other_in_order() {
    use voxtile::space::VoxelBox;
    use voxtile_compare::VoxelClass;
    let config = MapConfig::new(RESOLUTION_M, 4.0).unwrap();
    let voxels = VoxelBox { min: [-2, 0, -1], end: [8, 4, 9] };
    let picture = plain();
    let mut drawing = picture.start_comparison(&config, voxels).unwrap();
    // A column with each class on top of those before, from the highest to the lowest voxel.
    for (x, class) in VoxelClass::ALL.into_iter().enumerate().map(|(k, class)| (k as i32 - 2, class)) {
        drawing.add_compared([x, 1, 0], class, false);
        drawing.add_compared([x, 1, 8], VoxelClass::Unchanged, false);
    }
    drawing.add_compared([0, 1, 3], VoxelClass::Appeared, false);
    drawing.add_compared([0, 1, 2], VoxelClass::Vanished, true);
    drawing.add_compared([8, 1, 0], VoxelClass::Vanished, false);
    drawing.add_box(Aabb { min: [-1.0, 0.5, 0.0], max: [9.0, 1.0, 0.5] }, "1");
    let drawn = drawing.finish();
    let of = |class| colors::comparison_color(class);
    let row: Vec<[u8; 3]> = (0..9).map(|across| cell(&drawn, [across, 0])).collect();
    let mut wanted = VoxelClass::ALL.map(of);
    wanted[2] = of(VoxelClass::Vanished);
    assert_eq!(row, wanted);
    assert_eq!(drawn.region_m.unwrap().min, [-1.0, 0.5, -0.5]);
    // Nothing was added, or the box is empty.
    assert_eq!(picture.start_comparison(&config, voxels).unwrap().finish().region_m, None);
    let empty = VoxelBox { min: [0; 3], end: [0; 3] };
    let mut drawing = picture.start_comparison(&config, empty).unwrap();
    drawing.add_compared([0; 3], VoxelClass::Appeared, false);
    assert_eq!(drawing.finish().region_m, None);
}

/// Returns the alpha in a cell.
fn alpha(drawn: &Drawn, [across, up]: [usize; 2]) -> u8 {
    let [left, top, _, height] = drawn.map_px;
    let [x, y] = [left + across * drawn.cell_px + 1, top + height - 1 - up * drawn.cell_px - 1];
    drawn.image.rgba()[4 * (x + y * drawn.image.width_px()) + 3]
}

#[test]
fn backgrounds_have_their_colors() {
    let on = |background| draw(&plain().with_background(background), &wall());
    for (background, unknown) in
        [(Background::Dark, colors::UNKNOWN), (Background::Black, [0; 3]), (Background::White, [255; 3])]
    {
        let drawn = on(background);
        assert_eq!(cell(&drawn, [5, 1]), unknown);
        assert_eq!(cell(&drawn, [5, 3]), colors::color_of(0.0));
        assert_ne!(cell(&drawn, [0, 0]), unknown, "free space");
        assert_eq!(alpha(&drawn, [5, 1]), 255);
    }
    let clear = on(Background::Transparent);
    assert_eq!([[5, 1], [5, 3], [0, 0]].map(|at| alpha(&clear, at)), [0, 255, 255]);
    assert_eq!(cell(&clear, [0, 0]), cell(&on(Background::White), [0, 0]));
}

#[test]
fn pictures_of_print_size_have_its_resolution_and_type() {
    let map = map_of(&[center([0; 3]), center([9_999, 3, 0])], &[]);
    let picture = Picture::new().with_size_px([10_000; 2]);
    let (page, print) = (draw(&picture, &map), draw(&picture.with_dpi(Some(600.0)), &map));
    assert_eq!((page.cell_px, page.map_px[2]), (1, 10_000));
    // By default as wide as a page.
    assert!((10_000.0 / page.image.dpi() - 6.7).abs() < 1e-9);
    let mut png = Vec::new();
    print.image.write_png(&mut png).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(&png)).read_info().unwrap();
    assert_eq!(reader.info().pixel_dims.map(|dims| [dims.xppu, dims.yppu]), Some([23_622; 2]));
    // The rest is title and legend, whose height is in points.
    let points =
        |drawn: &Drawn| (drawn.image.height_px() - drawn.map_px[3]) as f64 / drawn.image.dpi() * 72.0;
    assert!((points(&page) - points(&print)).abs() < 0.5, "{} and {}", points(&page), points(&print));
}
