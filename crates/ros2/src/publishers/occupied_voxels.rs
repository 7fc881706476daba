use super::Extent;
use super::voxel_changes::VoxelState;
use crate::messages::{Color, Header, Marker, MarkerArray, PointCloud2};
use anyhow::bail;
use voxtile::{Aabb, Grid, MapQueries, MapView, VoxelIndex};

/// Maximum number of voxels in a message: larger messages are not delivered over DDS.
pub(super) const MAX_VOXELS: usize = 4 << 20;
const COLOR: Color = Color { r: 0.0, g: 0.0, b: 1.0, a: 1.0 };

/// Colour of voxels without one in a map with colours, as in OctoMap.
const WHITE: [u8; 3] = [255; 3];

/// Occupied voxel with its colour, if the map has colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct OccupiedVoxel {
    pub voxel: VoxelIndex,
    pub colour: Option<[u8; 3]>,
}

/// Returns the occupied voxels of a region that overlap the range of heights.
///
/// # Errors
///
/// More voxels than a message may contain, or a tile that cannot be read.
pub fn occupied_voxels(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
) -> anyhow::Result<Vec<OccupiedVoxel>> {
    let grid = map.config().grid;
    let (mut voxels, mut count) = (Vec::new(), 0);
    map.for_each_occupied(None, Some(region), |voxel| {
        if extent.reaches(grid.center_m(voxel.index)[2], grid.resolution_m()) {
            count += 1;
            if count <= MAX_VOXELS {
                voxels.push(OccupiedVoxel { voxel: voxel.index, colour: None });
            }
        }
    })?;
    if count > MAX_VOXELS {
        bail!(
            "{count} occupied voxels exceed the limit of {MAX_VOXELS} per message: use a smaller --publish-radius"
        );
    }
    if map.config().layers().colour {
        set_colours(map, &mut voxels)?;
    }
    Ok(voxels)
}

/// Sets the mean colours of voxels that are sorted by tile.
fn set_colours(map: &impl MapView, voxels: &mut [OccupiedVoxel]) -> voxtile::Result<()> {
    let grid = map.config().grid;
    let tile_of = |voxel: &OccupiedVoxel| grid.tile_of_voxel(voxel.voxel);
    for of_tile in voxels.chunk_by_mut(|a, b| tile_of(a) == tile_of(b)) {
        let tile = of_tile.first().map(tile_of).map(|tile| map.tile(tile)).transpose()?.flatten();
        for OccupiedVoxel { voxel, colour } in of_tile {
            let layers = tile.as_ref().and_then(|tile| tile.layers_of(*voxel));
            *colour = Some(layers.and_then(|layers| layers.mean_colour()).unwrap_or(WHITE));
        }
    }
    Ok(())
}

/// Returns the occupied voxels as a cloud, with colours if the map has them.
pub fn cloud(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<PointCloud2> {
    let grid = map.config().grid;
    let voxels = occupied_voxels(map, region, extent)?;
    if !map.config().layers().colour {
        return Ok(PointCloud2::of_points(header, voxels.iter().map(|of| grid.center_m(of.voxel))));
    }
    let points = voxels.iter().map(|of| (grid.center_m(of.voxel), of.colour.unwrap_or(WHITE)));
    Ok(PointCloud2::of_colours(header, points))
}

/// Returns the changes of occupied voxels as a cloud, with colours if the map has them. `occupied` is sorted. Voxels that
/// are no longer occupied are white.
pub fn changes_cloud(
    grid: &Grid,
    changes: &[(VoxelIndex, VoxelState)],
    occupied: &[OccupiedVoxel],
    has_colours: bool,
    header: Header,
) -> PointCloud2 {
    let states = changes.iter().map(|&(voxel, state)| (grid.center_m(voxel), state as u8));
    if !has_colours {
        return PointCloud2::of_states(header, states);
    }
    let colour_of = |voxel: &VoxelIndex| {
        let found = occupied.binary_search_by_key(voxel, |of| of.voxel);
        found.ok().and_then(|at| occupied[at].colour).unwrap_or(WHITE)
    };
    let colours = changes.iter().map(|(voxel, _)| colour_of(voxel));
    let points = states.zip(colours).map(|((center_m, state), colour)| (center_m, state, colour));
    PointCloud2::of_coloured_states(header, points)
}

/// Returns the occupied voxels as cubes, with colours if the map has them.
pub fn markers(
    map: &impl MapView,
    region: &Aabb,
    extent: &Extent,
    header: Header,
) -> anyhow::Result<MarkerArray> {
    let grid = map.config().grid;
    let voxels = occupied_voxels(map, region, extent)?;
    let centers_m = voxels.iter().map(|of| grid.center_m(of.voxel)).collect();
    let mut cubes = Marker::of_cubes(header, grid.resolution_m(), COLOR, centers_m);
    // One per cube, or none.
    cubes.colors = voxels.iter().filter_map(|of| of.colour).map(Color::of_bytes).collect();
    Ok(MarkerArray { markers: vec![cubes] })
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{Layers, MapConfig, Mapper, OutOfCoreTileMapper, PointAttributes, ScanRef};

    #[test]
    fn voxels_are_published_with_the_colours_of_the_map() {
        let folder = tempfile::tempdir().unwrap();
        let everywhere = Aabb { min: [-100.0; 3], max: [100.0; 3] };
        let extent = Extent { radius_m: 50.0, heights_m: [f64::NEG_INFINITY, f64::INFINITY] };
        let points = [[2.05, 0.05, 0.05], [2.06, 0.06, 0.05], [31.05, 0.05, 0.05], [0.05, 5.05, 0.05]];
        let colours = vec![Some([10, 20, 30]), Some([20, 30, 50]), Some([255, 0, 1]), None];
        let attributes = PointAttributes { colours, classes: Vec::new(), ..PointAttributes::default() };
        let scan = ScanRef::in_world([0.05; 3], &points).with_attributes(&attributes).unwrap();
        let make = |name: &str, layers: &str| {
            let config = MapConfig::new(0.1, 10.0).unwrap().with_layers(layers.parse::<Layers>().unwrap());
            let mut mapper = OutOfCoreTileMapper::create(folder.path().join(name), config).unwrap();
            mapper.insert_points(&scan).unwrap();
            mapper
        };
        let coloured = make("coloured", "colour");
        let mut voxels = occupied_voxels(&coloured, &everywhere, &extent).unwrap();
        voxels.sort_unstable();
        let found: Vec<_> = voxels.iter().map(|of| (of.voxel, of.colour.unwrap())).collect();
        let expected = [([0, 50, 0], WHITE), ([20, 0, 0], [15, 25, 40]), ([310, 0, 0], [255, 0, 1])];
        assert_eq!(found, expected);
        let names = |cloud: &PointCloud2| -> Vec<String> {
            cloud.fields.iter().map(|field| format!("{}@{}", field.name, field.offset)).collect()
        };
        let centers = cloud(&coloured, &everywhere, &extent, Header::default()).unwrap();
        assert_eq!((centers.point_step, names(&centers).join(" ")), (16, "x@0 y@4 z@8 rgb@12".to_owned()));
        let row = centers.data.chunks(16).find(|row| row[..4] == 2.05_f32.to_le_bytes()).unwrap();
        assert_eq!(row[12..], [40, 25, 15, 0]);
        let cubes = markers(&coloured, &everywhere, &extent, Header::default()).unwrap().markers.remove(0);
        let at = cubes.points.iter().position(|center_m| center_m[0] > 30.0).unwrap();
        assert_eq!((cubes.colors.len(), cubes.colors[at]), (3, Color::of_bytes([255, 0, 1])));
        let changes = [([0, 0, 1], VoxelState::NotOccupied), ([20, 0, 0], VoxelState::Occupied)];
        let grid = coloured.config().grid;
        let sent = changes_cloud(&grid, &changes, &voxels, true, Header::default());
        assert_eq!((sent.point_step, names(&sent).join(" ")), (20, "x@0 y@4 z@8 state@12 rgb@16".to_owned()));
        assert_eq!(
            (&sent.data[12..20], &sent.data[32..]),
            (&[0, 0, 0, 0, 255, 255, 255, 0][..], &[1, 0, 0, 0, 40, 25, 15, 0][..])
        );

        let plain = make("plain", "none");
        let centers = cloud(&plain, &everywhere, &extent, Header::default()).unwrap();
        assert_eq!((centers.point_step, centers.width), (12, 3));
        let cubes = markers(&plain, &everywhere, &extent, Header::default()).unwrap().markers.remove(0);
        assert!(cubes.colors.is_empty() && cubes.points.len() == 3);
        let voxels = occupied_voxels(&plain, &everywhere, &extent).unwrap();
        assert_eq!(changes_cloud(&grid, &changes, &voxels, false, Header::default()).point_step, 16);
    }
}
