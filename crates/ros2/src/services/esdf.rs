use crate::distances::Distances;
use crate::live_map::{LiveMap, Moment};
use crate::messages::{EsdfRequest, EsdfResponse, FloatArray};
use anyhow::{bail, ensure};
use voxtile::{Aabb, Error, Grid, Point};
use voxtile_distance::{Distance, DistanceField, MapDistances};

/// Value of unknown voxels: the default of nvblox.
const UNKNOWN: f32 = -1000.0;
/// Largest number of voxels of a response.
const MAX_VOXELS: u64 = 16 << 20;
/// Maximum number of attempts while the map changes.
const ATTEMPTS: usize = 4;
/// Bytes of a response besides the distances, rounded up.
const OTHER_BYTES: usize = 256;

/// Returns signed distances of a box. On failure `success` is false, and the log has the reason.
pub fn in_box(
    map: &LiveMap,
    distances: &Distances,
    max_bytes: Option<usize>,
    request: &EsdfRequest,
) -> EsdfResponse {
    let moment = map.moment();
    make(map, distances, &moment, max_bytes, request).unwrap_or_else(|error| {
        log::warn!("cannot compute requested distances: {error:#}");
        EsdfResponse { header: map.header(&moment), ..EsdfResponse::default() }
    })
}

fn make(
    map: &LiveMap,
    distances: &Distances,
    moment: &Moment,
    max_bytes: Option<usize>,
    request: &EsdfRequest,
) -> anyhow::Result<EsdfResponse> {
    let header = map.header(moment);
    let frame = &request.frame_id;
    ensure!(
        frame.is_empty() || *frame == header.frame_id,
        "the box is in the frame {frame}, and only {} is supported",
        header.frame_id
    );
    if !(request.aabbs_to_clear_min_m.is_empty() && request.spheres_to_clear_center_m.is_empty()) {
        bail!("boxes and spheres to clear are not supported");
    }
    let region = match request.use_aabb {
        false => distances.around(moment.sensor_m),
        true => touched(map.grid(), request.aabb_min_m, request.aabb_size_m)?,
    };
    let voxels = map.grid().voxels_in(&region);
    let size = [0, 1, 2].map(|k| (i64::from(voxels.end[k]) - i64::from(voxels.min[k])).max(0) as u64);
    let count = size.iter().fold(1, |product: u64, edge| product.saturating_mul(*edge));
    ensure!(count <= MAX_VOXELS, "the box has {count} voxels, and at most {MAX_VOXELS} are supported");
    let bytes = 4 * count as usize + header.frame_id.len() + OTHER_BYTES;
    ensure!(
        max_bytes.is_none_or(|most| bytes <= most),
        "the response has {bytes} bytes, and at most {} arrive over Fast DDS; request a smaller box, or use Zenoh or \
         Cyclone DDS",
        max_bytes.unwrap_or_default(),
    );
    let field = field_of(map, &region, distances)?;
    let mut data = Vec::with_capacity(count as usize);
    for x in voxels.min[0]..voxels.end[0] {
        for y in voxels.min[1]..voxels.end[1] {
            for z in voxels.min[2]..voxels.end[2] {
                let distance = field.voxel([x, y, z]).in_metres(map.grid().resolution_m());
                data.push(match distance {
                    Distance::Unknown => UNKNOWN,
                    known => known
                        .capped_m(distances.max_distance_m)
                        .map_or(UNKNOWN, |distance_m| distance_m as f32),
                });
            }
        }
    }
    Ok(EsdfResponse {
        header,
        origin_m: voxels.min.map(|k| map.grid().corner_m(k)),
        voxel_size_m: map.grid().resolution_m() as f32,
        esdf_and_gradients: FloatArray::of_box(size.map(|edge| edge as u32), data),
        success: true,
    })
}

/// Returns the box of all voxels that touch a box.
fn touched(grid: &Grid, min_m: Point, size_m: Point) -> anyhow::Result<Aabb> {
    let max_m = std::array::from_fn(|k| min_m[k] + size_m[k]);
    let is_valid = size_m.iter().all(|edge_m| *edge_m > 0.0);
    let (Some(low), Some(high)) = (grid.voxel_of(min_m), grid.voxel_of(max_m)) else {
        bail!("the box from {min_m:?} to {max_m:?} is outside of the map's space");
    };
    ensure!(is_valid, "the box has the size {size_m:?}; its edges must be above 0");
    let metres = |k: i32| f64::from(k) * grid.resolution_m();
    Ok(Aabb { min: low.map(metres), max: high.map(|k| metres(k.saturating_add(1))) })
}

fn field_of(map: &LiveMap, region: &Aabb, distances: &Distances) -> voxtile::Result<DistanceField> {
    let attempt = || map.view().distance_field(region, distances.options().with_sign(true));
    let mut made = attempt();
    for _ in 1..ATTEMPTS {
        if !matches!(made, Err(Error::Expired)) {
            break;
        }
        made = attempt();
    }
    made
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{MapConfig, Mapper, OutOfCoreTileMapper, Scan};

    fn map(folder: &std::path::Path) -> (OutOfCoreTileMapper, LiveMap) {
        let config = MapConfig::new(0.5, 10.0).unwrap();
        let mut mapper = OutOfCoreTileMapper::create(folder.join("map"), config).unwrap();
        let scan = Scan { origin: [0.25; 3], points: vec![[4.25, 0.25, 0.25]], intensities: None };
        mapper.insert_scan(&scan).unwrap();
        let live = LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.25; 3], 7);
        (mapper, live)
    }

    #[test]
    fn distances_of_a_box_are_those_of_the_field() {
        let folder = tempfile::tempdir().unwrap();
        let (_mapper, live) = map(folder.path());
        let distances = Distances::new(0.2, 1.0, 5.0, 1.0).unwrap();
        let request = EsdfRequest {
            use_aabb: true,
            frame_id: "map".to_owned(),
            aabb_min_m: [2.6, 0.1, 0.1],
            aabb_size_m: [2.0, 0.2, 0.6],
            ..EsdfRequest::default()
        };
        let found = in_box(&live, &distances, None, &request);
        assert!(found.success);
        assert_eq!((found.origin_m, found.voxel_size_m), ([2.5, 0.0, 0.0], 0.5));
        let FloatArray { dim, data, .. } = found.esdf_and_gradients;
        let shape: Vec<_> = dim.iter().map(|dim| (dim.label.as_str(), dim.size, dim.stride)).collect();
        assert_eq!(shape, [("x", 5, 10), ("y", 1, 2), ("z", 2, 2)]);
        // Beyond the cap, within it, and inside of the obstacle: half a metre to the free voxel.
        let row = [1.0, UNKNOWN, 1.0, UNKNOWN, 0.5, UNKNOWN, -0.5, UNKNOWN, UNKNOWN, UNKNOWN];
        assert_eq!(data, row);
        let around = in_box(&live, &distances, None, &EsdfRequest::default());
        assert!(around.success && around.esdf_and_gradients.data.len() == 20 * 20 * 4, "{around:?}");
    }

    #[test]
    fn unsupported_requests_fail() {
        let folder = tempfile::tempdir().unwrap();
        let (_mapper, live) = map(folder.path());
        let distances = Distances::new(0.2, 1.0, 5.0, 1.0).unwrap();
        let fails = |request: &EsdfRequest, max_bytes| !in_box(&live, &distances, max_bytes, request).success;
        let of_box = |aabb_min_m, aabb_size_m| EsdfRequest {
            use_aabb: true,
            aabb_min_m,
            aabb_size_m,
            ..EsdfRequest::default()
        };
        assert!(fails(&of_box([0.0; 3], [0.0, 1.0, 1.0]), None));
        assert!(fails(&of_box([f64::NAN; 3], [1.0; 3]), None));
        assert!(fails(&of_box([0.0; 3], [1e6; 3]), None));
        assert!(fails(&of_box([0.0; 3], [5.0; 3]), Some(300)));
        assert!(fails(&EsdfRequest { frame_id: "odom".to_owned(), ..EsdfRequest::default() }, None));
        let clears = EsdfRequest { spheres_to_clear_center_m: vec![[0.0; 3]], ..EsdfRequest::default() };
        assert!(fails(&clears, None));
        for wrong in [
            [f64::NAN, 1.0, 1.0, 1.0],
            [0.2, 0.0, 1.0, 1.0],
            [0.2, 1.0, -1.0, 1.0],
            [0.2, 1.0, 1.0, f64::INFINITY],
        ] {
            let [every, cap, radius, height] = wrong;
            assert!(Distances::new(every, cap, radius, height).is_err(), "{wrong:?}");
        }
    }
}
