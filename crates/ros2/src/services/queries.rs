use crate::live_map::LiveMap;
use crate::messages::{CollisionRequest, HitResponse, RayRequest};
use voxtile::{Queries, RayQuery, Shape, UnknownAs};

/// Returns the first obstacle on a ray.
pub fn cast_ray(map: &LiveMap, request: RayRequest) -> HitResponse {
    let RayRequest { origin, direction, max_range, unknown_is_obstacle } = request;
    let max_range_m = (max_range != 0.0).then_some(max_range);
    let unknown = unknown_as(unknown_is_obstacle);
    HitResponse::of(map.reader().cast_ray(&RayQuery { origin, direction, max_range_m, unknown }))
}

/// Returns an obstacle on the path of a ball.
pub fn check_collision(map: &LiveMap, request: CollisionRequest) -> HitResponse {
    let CollisionRequest { from, to, radius, unknown_is_obstacle } = request;
    let body = Shape::SweptSphere { from, to, radius_m: radius };
    HitResponse::of(map.reader().collision(&body, unknown_as(unknown_is_obstacle)))
}

fn unknown_as(is_obstacle: bool) -> UnknownAs {
    if is_obstacle { UnknownAs::Obstacle } else { UnknownAs::Free }
}
