//! Pictures by the layers of a map: pixels of a known scene.

use voxtile::mapper::MapView;
use voxtile::space::{Aabb, Point};
use voxtile::{InMemoryMapper, Layers, MapConfig, Mapper, PointAttributes, ScanRef};
use voxtile_render::classes::class_color;
use voxtile_render::{ColorBy, Drawn, Layer, Picture, SideAxis, View, colors};

const RESOLUTION_M: f64 = 0.5;
const ALL: Layers =
    Layers { colour: true, intensity_max: Some(100.0), class: true, time: true, shape: false };
const FIRST_S: i64 = 1_317_042_272;

/// A point with its attributes; `None` for a point without.
type Point5 = (Point, Option<([u8; 3], u8)>, f32, i64);

/// A map of hits with a scan per time, in seconds after the first.
fn map_of(layers: Layers, points: &[Point5]) -> InMemoryMapper {
    let mut map =
        InMemoryMapper::new(MapConfig::new(RESOLUTION_M, 4.0).unwrap().with_layers(layers)).unwrap();
    let mut times: Vec<i64> = points.iter().map(|(.., time)| *time).collect();
    times.sort_unstable();
    times.dedup();
    for time in times {
        let of_scan: Vec<_> = points.iter().filter(|point| point.3 == time).collect();
        let places: Vec<Point> = of_scan.iter().map(|point| point.0).collect();
        let intensities: Vec<f32> = of_scan.iter().map(|point| point.2).collect();
        let attributes = PointAttributes {
            colours: of_scan.iter().map(|point| point.1.map(|(colour, _)| colour)).collect(),
            classes: of_scan.iter().map(|point| point.1.map(|(_, class)| class)).collect(),
            ..PointAttributes::default()
        };
        // From far above, so that rays do not cross the voxels of others.
        let scan =
            ScanRef::in_world([2.0, 0.25, 900.0], &places).with_stamp_ns((FIRST_S + time) * 1_000_000_000);
        let scan = scan.with_intensities(&intensities).unwrap().with_attributes(&attributes).unwrap();
        map.insert_points(&scan).unwrap();
    }
    map
}

fn center(voxel: [i32; 3]) -> Point {
    voxel.map(|index| (f64::from(index) + 0.5) * RESOLUTION_M)
}

/// A row of voxels along x: two points of one voxel, a voxel below another one, one without attributes.
fn scene() -> Vec<Point5> {
    vec![
        (center([0, 0, 0]), Some(([10, 20, 30], 2)), 10.0, 0),
        (center([0, 0, 0]), Some(([20, 40, 60], 6)), 30.0, 0),
        (center([0, 0, 0]), Some(([30, 60, 90], 6)), 20.0, 10),
        (center([1, 0, 0]), Some(([200, 100, 50], 5)), 60.0, 20),
        (center([2, 0, 0]), None, f32::NAN, 20),
        (center([3, 0, 0]), Some(([0, 255, 0], 9)), 100.0, 30),
        (center([4, 0, 0]), Some(([255, 255, 255], 19)), 40.0, 5),
    ]
}

fn plain(layer: Layer) -> Picture {
    let picture = Picture::new().with_legend(false).with_grid(false).with_size_px([240; 2]);
    picture.with_color(ColorBy::Layer(layer))
}

fn draw(picture: &Picture, map: &impl MapView) -> Drawn {
    picture.draw(map, |_, _| {}).unwrap()
}

/// Colors of the cells of the lowest row, from the left.
fn row(drawn: &Drawn) -> Vec<[u8; 3]> {
    let [left, top, width, height] = drawn.map_px;
    let half = drawn.cell_px / 2;
    let cells = 0..width / drawn.cell_px;
    cells
        .map(|cell| drawn.image.pixel(left + cell * drawn.cell_px + half, top + height - 1 - half).unwrap())
        .collect()
}

#[test]
fn colors_are_means_of_the_points() {
    let drawn = draw(&plain(Layer::Colour), &map_of(ALL, &scene()));
    let wanted = [[20, 40, 60], [200, 100, 50], colors::NO_VALUE, [0, 255, 0], [255; 3]];
    assert_eq!(row(&drawn), wanted);
    assert_eq!((drawn.range, drawn.cells_without_value, drawn.classes), (None, 1, vec![]));
}

#[test]
fn classes_have_fixed_colors() {
    let drawn = draw(&plain(Layer::Class), &map_of(ALL, &scene()));
    let wanted = [class_color(6), class_color(5), colors::NO_VALUE, class_color(9), class_color(19)];
    assert_eq!(row(&drawn), wanted);
    assert_eq!(drawn.classes, [(5, 1), (6, 1), (9, 1), (19, 1)]);
    // The legend has their colors and names: it is wider and higher than that of heights.
    let map = map_of(ALL, &scene());
    let [height, class] = [ColorBy::Height, ColorBy::Layer(Layer::Class)]
        .map(|color| draw(&Picture::new().with_grid(false).with_color(color), &map).image);
    assert!(class.height_px() > height.height_px());
    let count = |color: [u8; 3]| class.rgba().chunks(4).filter(|pixel| pixel[..3] == color).count();
    for color in [class_color(5), class_color(6), class_color(9), class_color(19), colors::NO_VALUE] {
        // A cell of the map has 48 x 48 pixels.
        assert!(count(color) > 48 * 48 + 20, "{color:?}");
    }
}

#[test]
fn intensities_are_drawn_between_two_percentiles() {
    let map = map_of(ALL, &scene());
    let drawn = draw(&plain(Layer::Intensity), &map);
    let [least, most] = drawn.range.unwrap();
    assert!((least - 20.0).abs() < 0.01 && (most - 100.0).abs() < 0.01, "{:?}", drawn.range);
    let colors_of: Vec<[u8; 3]> =
        [20.0, 60.0, 100.0, 40.0].map(|value| colors::color_of((value - 20.0) / 80.0)).into();
    let found = row(&drawn);
    assert_eq!(found[2], colors::NO_VALUE);
    assert_eq!([found[0], found[1], found[3], found[4]].to_vec(), colors_of);
    // One of a hundred voxels is far brighter.
    let mut many: Vec<Point5> = (0..100)
        .map(|x| (center([x, 0, 0]), None, if x == 7 { 100.0 } else { 1.0 + (x % 2) as f32 }, 0))
        .collect();
    many.push((center([100, 0, 0]), None, 2.0, 0));
    let range = draw(&plain(Layer::Intensity), &map_of(ALL, &many)).range.unwrap();
    assert!((range[0] - 1.0).abs() < 0.01 && (range[1] - 2.0).abs() < 0.01, "{range:?}");
}

#[test]
fn ages_are_times_of_the_last_hit() {
    let drawn = draw(&plain(Layer::Time), &map_of(ALL, &scene()));
    let first_s = FIRST_S as f64;
    assert_eq!(drawn.range, Some([first_s + 5.0, first_s + 30.0]));
    let wanted = [10.0, 20.0, 20.0, 30.0, 5.0].map(|second| colors::color_of((second - 5.0) / 25.0));
    assert_eq!(row(&drawn), wanted);
}

#[test]
fn the_topmost_voxel_counts_and_from_the_side_the_nearest() {
    let points = [
        (center([0, 0, 0]), Some(([255, 0, 0], 2)), 1.0, 0),
        (center([0, 0, 3]), Some(([0, 0, 255], 6)), 1.0, 0),
        (center([0, 2, 3]), Some(([0, 255, 0], 5)), 1.0, 0),
        (center([7, 0, 0]), Some(([9, 9, 9], 2)), 1.0, 0),
    ];
    let map = map_of(ALL, &points);
    let above = draw(&plain(Layer::Colour), &map);
    assert_eq!((row(&above)[0], row(&above)[7]), ([0, 0, 255], [9, 9, 9]));
    let region = Aabb { min: [0.0; 3], max: [4.0, 4.0, 2.0] };
    let side = plain(Layer::Colour).with_view(View::Side(SideAxis::X)).with_region(region);
    let [left, top, ..] = draw(&side, &map).map_px;
    // Seen along +y, the voxel with y 0 hides that with y 1.
    let pixel = draw(&side, &map).image.pixel(left + 3, top + 3).unwrap();
    assert!(pixel[2] > 150 && pixel[1] < 60, "{pixel:?}");
    let layer = plain(Layer::Class).with_view(View::Slice { z_m: 0.1, thickness_m: 0.0 });
    assert_eq!(row(&draw(&layer, &map))[0], class_color(2));
}

#[test]
fn a_cell_of_several_voxels_has_the_mean_of_the_topmost_for_any_threads() {
    let gradient = |x: i32, y: i32| [(x % 256) as u8, (y % 256) as u8, ((x * y) % 256) as u8];
    let voxels = (0..40).flat_map(|x| (0..40).map(move |y| [x, y, (x + y) % 3]));
    let points: Vec<Point5> = voxels
        .map(|[x, y, z]| {
            let attributes = Some((gradient(x, y), ((x + 3 * y) % 7) as u8));
            (center([x, y, z]), attributes, (x % 50) as f32, i64::from(y % 9))
        })
        .collect();
    let map = map_of(ALL, &points);
    // 4 x 4 voxels per cell.
    let pictures = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Layer::ALL.map(|layer| draw(&plain(layer).with_size_px([10; 2]), &map)))
    };
    let drawn = pictures(1);
    for threads in [2, 3, 8] {
        for (one, other) in drawn.iter().zip(pictures(threads)) {
            assert!(one.image == other.image && one.classes == other.classes, "{threads} threads");
        }
    }
    assert_eq!((drawn[0].cell_px, drawn[0].cell_m), (1, 4.0 * RESOLUTION_M));
    let top: Vec<[u8; 3]> = (0..4)
        .flat_map(|x| (0..4).map(move |y| (x, y)))
        .filter(|(x, y)| (x + y) % 3 == 2)
        .map(|(x, y)| gradient(x, y))
        .collect();
    let mean = |k: usize| {
        let sum: usize = top.iter().map(|color| usize::from(color[k])).sum();
        ((sum + top.len() / 2) / top.len()) as u8
    };
    let [left, row_px, _, height] = drawn[0].map_px;
    assert_eq!(drawn[0].image.pixel(left, row_px + height - 1), Some([mean(0), mean(1), mean(2)]));
}

#[test]
fn a_map_without_the_layer_is_refused() {
    let points = scene();
    let map = map_of(Layers { class: true, ..Layers::NONE }, &points);
    let error = plain(Layer::Colour).draw(&map, |_, _| {}).unwrap_err().to_string();
    assert!(error.contains("colour") && error.contains("class") && error.contains("`layers`"), "{error}");
    assert!(plain(Layer::Class).draw(&map, |_, _| {}).is_ok());
    let error = plain(Layer::Time).draw(&map_of(Layers::NONE, &points), |_, _| {}).unwrap_err().to_string();
    assert!(error.contains("no layers"), "{error}");
}
