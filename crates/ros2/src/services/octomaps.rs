use crate::live_map::{LiveMap, Moment};
use crate::messages::{Empty, Octomap, OctomapInBoxRequest, OctomapInBoxResponse, OctomapResponse, Outcome};
use crate::publishers::{Extent, class_of, format_of, octomap};
use anyhow::ensure;
use voxtile::octree::OctreeFormat;
use voxtile::{Aabb, Error};

/// Maximum number of attempts to build an octree while the map changes.
const ATTEMPTS: usize = 4;

/// Returns the published octree. On failure it is empty, because the response has no field for an error.
pub fn around_sensor(
    map: &LiveMap,
    extent: &Extent,
    format: OctreeFormat,
    max_bytes: Option<usize>,
    _: Empty,
) -> OctomapResponse {
    let moment = map.moment();
    let made = make(map, &moment, &extent.around(moment.sensor_m), format, max_bytes);
    let map = made.unwrap_or_else(|error| {
        log::warn!("cannot build a requested octree: {error:#}");
        empty(map, &moment, format)
    });
    OctomapResponse { map }
}

pub fn in_box(map: &LiveMap, max_bytes: Option<usize>, request: OctomapInBoxRequest) -> OctomapInBoxResponse {
    let OctomapInBoxRequest { min, max, binary } = request;
    let format = if binary { OctreeFormat::Bt } else { OctreeFormat::Ot };
    if !(0..3).all(|k| min[k] < max[k]) {
        let outcome = Outcome::from(Err(format!(
            "the minimum corner {min:?} must be below the maximum corner {max:?} on every axis"
        )));
        return OctomapInBoxResponse { outcome, map: Octomap::default() };
    }
    match make(map, &map.moment(), &Aabb { min, max }, format, max_bytes) {
        Ok(map) => OctomapInBoxResponse { outcome: Outcome::from(Ok(String::new())), map },
        Err(error) => {
            let outcome = Outcome::from(Err(format!("{error:#}")));
            OctomapInBoxResponse { outcome, map: Octomap::default() }
        }
    }
}

/// Returns a tree without nodes. Readers use its type and resolution even if it is empty.
fn empty(map: &LiveMap, moment: &Moment, format: OctreeFormat) -> Octomap {
    let (binary, resolution) = (format == OctreeFormat::Bt, map.grid().resolution_m());
    let id = class_of(format_of(format, map.layers())).to_owned();
    Octomap { header: map.header(moment), binary, id, resolution, data: Vec::new() }
}

/// Bytes of a response besides the octree and the name of the frame, rounded up.
const OTHER_BYTES: usize = 96;

fn make(
    map: &LiveMap,
    moment: &Moment,
    region: &Aabb,
    format: OctreeFormat,
    max_bytes: Option<usize>,
) -> anyhow::Result<Octomap> {
    let attempt = || octomap(&map.view(), region, format, map.header(moment));
    let mut made = attempt();
    for _ in 1..ATTEMPTS {
        let is_expired = |error: &anyhow::Error| matches!(error.downcast_ref(), Some(Error::Expired));
        if !made.as_ref().is_err_and(is_expired) {
            break;
        }
        made = attempt();
    }
    let made = made?;
    let bytes = made.data.len() + made.header.frame_id.len() + OTHER_BYTES;
    ensure!(
        max_bytes.is_none_or(|most| bytes <= most),
        "the response has {bytes} bytes, and at most {} arrive over Fast DDS; subscribe to the topic of the octree, \
         request a smaller box, or use Zenoh or Cyclone DDS",
        max_bytes.unwrap_or_default(),
    );
    Ok(made)
}

#[cfg(test)]
mod tests {
    use super::*;
    use voxtile::{Layers, MapConfig, Mapper, OutOfCoreTileMapper, PointAttributes, Scan, ScanRef};

    #[test]
    fn a_failed_octree_is_empty_with_the_properties_of_the_map() {
        let folder = tempfile::tempdir().unwrap();
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        // Outside the keys of an octree.
        let origin = [9000.05, 0.05, 0.05];
        let scan = Scan { origin, points: vec![[9001.05, 0.05, 0.05]], intensities: None };
        mapper.insert_scan(&scan).unwrap();
        let map = LiveMap::new("map".to_owned(), mapper.reader().unwrap(), origin, 7);
        let extent = Extent { radius_m: 5.0, heights_m: [f64::NEG_INFINITY, f64::INFINITY] };
        for (format, binary) in [(OctreeFormat::Bt, true), (OctreeFormat::Ot, false)] {
            let made = around_sensor(&map, &extent, format, None, Empty::default()).map;
            assert_eq!(
                (made.binary, &*made.id, made.resolution, made.data.len()),
                (binary, "OcTree", 0.1, 0)
            );
            assert_eq!((&*made.header.frame_id, made.header.stamp.nanosec), ("map", 7));
        }
    }

    #[test]
    fn a_map_with_colours_has_a_color_octree() {
        let folder = tempfile::tempdir().unwrap();
        let layers: Layers = "colour".parse().unwrap();
        let config = MapConfig::new(0.1, 10.0).unwrap().with_layers(layers);
        let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        let attributes = PointAttributes {
            colours: vec![Some([1, 2, 3])],
            classes: Vec::new(),
            ..PointAttributes::default()
        };
        let points = [[2.05, 0.05, 0.05]];
        let scan = ScanRef::in_world([0.05; 3], &points).with_attributes(&attributes).unwrap();
        mapper.insert_points(&scan).unwrap();
        let map = LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.05; 3], 7);
        let extent = Extent { radius_m: 5.0, heights_m: [f64::NEG_INFINITY, f64::INFINITY] };
        let full = around_sensor(&map, &extent, OctreeFormat::Ot, None, Empty::default()).map;
        assert_eq!((&*full.id, full.binary, full.data.len() % 8), ("ColorOcTree", false, 0));
        assert!(full.data.windows(3).any(|bytes| bytes == [1, 2, 3]));
        let binary = around_sensor(&map, &extent, OctreeFormat::Bt, None, Empty::default()).map;
        assert_eq!((&*binary.id, binary.binary), ("OcTree", true));
    }

    #[test]
    fn a_response_that_would_not_arrive_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let config = MapConfig::new(0.1, 10.0).unwrap();
        let mut mapper = OutOfCoreTileMapper::create(folder.path().join("map"), config).unwrap();
        let points = (0..100).map(|k| [5.05, 0.05 * f64::from(k), 1.05]).collect();
        mapper.insert_scan(&Scan { origin: [0.05; 3], points, intensities: None }).unwrap();
        let map = LiveMap::new("map".to_owned(), mapper.reader().unwrap(), [0.05; 3], 7);
        let request = || OctomapInBoxRequest { min: [0.0; 3], max: [9.0; 3], binary: true };
        let whole = in_box(&map, None, request());
        assert!(whole.outcome.success, "{whole:?}");
        let bytes = whole.map.data.len() + "map".len() + OTHER_BYTES;
        assert_eq!(in_box(&map, Some(bytes), request()).map.data, whole.map.data);
        let refused = in_box(&map, Some(bytes - 1), request());
        assert!(!refused.outcome.success && refused.map.data.is_empty());
        assert!(refused.outcome.message.contains(&format!("at most {} arrive", bytes - 1)), "{refused:?}");
    }
}
