use crate::live_map::{LiveMap, Moment};
use crate::messages::{Empty, Octomap, OctomapInBoxRequest, OctomapInBoxResponse, OctomapResponse, Outcome};
use crate::publishers::{Extent, octomap};
use voxtile::octree::OctreeFormat;
use voxtile::{Aabb, Error};

/// How often an octree is made anew because too much changed meanwhile.
const ATTEMPTS: usize = 4;

/// The octree that is published, or an empty one: this response cannot say what is wrong.
pub fn around_sensor(map: &LiveMap, extent: &Extent, format: OctreeFormat, _: Empty) -> OctomapResponse {
    let moment = map.moment();
    let made = make(map, &moment, &extent.around(moment.sensor_m), format);
    let map = made.unwrap_or_else(|error| {
        log::warn!("an octree that was asked for cannot be made: {error:#}");
        Octomap { header: map.header(&moment), id: "OcTree".to_owned(), ..Octomap::default() }
    });
    OctomapResponse { map }
}

/// The octree of a box.
pub fn in_box(map: &LiveMap, request: OctomapInBoxRequest) -> OctomapInBoxResponse {
    let OctomapInBoxRequest { min, max, binary } = request;
    let format = if binary { OctreeFormat::Bt } else { OctreeFormat::Ot };
    if !(0..3).all(|k| min[k] < max[k]) {
        let outcome = Outcome::from(Err(format!("{min:?} is not below {max:?} along every axis")));
        return OctomapInBoxResponse { outcome, map: Octomap::default() };
    }
    match make(map, &map.moment(), &Aabb { min, max }, format) {
        Ok(map) => OctomapInBoxResponse { outcome: Outcome::from(Ok(String::new())), map },
        Err(error) => {
            let outcome = Outcome::from(Err(format!("{error:#}")));
            OctomapInBoxResponse { outcome, map: Octomap::default() }
        }
    }
}

fn make(map: &LiveMap, moment: &Moment, region: &Aabb, format: OctreeFormat) -> anyhow::Result<Octomap> {
    let ask = || octomap(&map.view(), region, format, map.header(moment));
    let mut made = ask();
    for _ in 1..ATTEMPTS {
        let is_expired = |error: &anyhow::Error| matches!(error.downcast_ref(), Some(Error::Expired));
        if !made.as_ref().is_err_and(is_expired) {
            break;
        }
        made = ask();
    }
    made
}
