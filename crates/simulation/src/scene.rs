use super::solid::{Contact, Ray};
use super::{Label, Solid};
use voxtile::space::Point;

/// Part of a world around one position: boxes in a grid of square cells, and the ground plane z = 0.
#[derive(Clone, Debug)]
pub struct Scene {
    solids: Vec<Solid>,
    ground_reflectivity: f64,
    /// Lower corner along x and y in metres, world frame.
    min: [f64; 2],
    /// Number of cells along x and y.
    cells: [usize; 2],
    /// Start of each cell's range in `members`, and the end of the last.
    starts: Vec<u32>,
    /// Indices of the boxes that touch a cell, cell by cell.
    members: Vec<u32>,
}

/// Hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin in metres.
    pub distance_m: f64,
    /// Share of reflected light, 0 to 1.
    pub reflectivity: f64,
    /// Cosine of the angle between ray and surface normal: 1 head-on, 0 grazing.
    pub cos_incidence: f64,
    /// Kind of the object; the ground plane is static.
    pub label: Label,
}

/// Edge length of a cell in metres: a street ray of 12 m crosses about four, each with a few boxes.
const CELL_M: f64 = 4.0;
/// Margin in metres by which a box is enlarged when it is sorted into cells, so that rounding cannot hide it from a
/// ray.
const MARGIN_M: f64 = 1e-6;

impl Scene {
    /// Maximum radius of a scene, and maximum range of a ray, in metres.
    pub const MAX_RADIUS_M: f64 = 400.0;

    /// Builds a scene of the boxes that overlap a square with half an edge of `radius_m` metres around a point. Others
    /// are ignored.
    pub fn new(mut solids: Vec<Solid>, ground_reflectivity: f64, center: Point, radius_m: f64) -> Self {
        let radius_m = bounded(radius_m);
        let min = [center[0] - radius_m, center[1] - radius_m];
        let edge_cells = (2.0 * radius_m / CELL_M) as usize + 1;
        let mut scene = Self {
            solids: Vec::new(),
            ground_reflectivity,
            min,
            cells: [edge_cells; 2],
            starts: vec![0; edge_cells * edge_cells + 1],
            members: Vec::new(),
        };
        solids.retain(|solid| scene.span(solid).is_some());
        // Count first, then fill, so that the boxes of a cell are contiguous.
        for solid in &solids {
            scene.each_cell_of(solid, |scene, cell| scene.starts[cell + 1] += 1);
        }
        for cell in 1..scene.starts.len() {
            scene.starts[cell] += scene.starts[cell - 1];
        }
        scene.members = vec![0; scene.starts.last().map_or(0, |&end| end as usize)];
        let mut next = scene.starts.clone();
        for (index, solid) in solids.iter().enumerate() {
            scene.each_cell_of(solid, |scene, cell| {
                scene.members[next[cell] as usize] = index as u32;
                next[cell] += 1;
            });
        }
        scene.solids = solids;
        scene
    }

    /// Returns the boxes in no particular order.
    pub fn solids(&self) -> &[Solid] {
        &self.solids
    }

    /// Returns whether a point (metres, world frame) is inside a box or below the ground.
    pub fn is_solid(&self, point: Point) -> bool {
        point[2] < 0.0 || self.solids.iter().any(|solid| solid.bounds.contains(point))
    }

    /// Returns the first hit of a ray up to and including `max_range_m` metres (world frame).
    ///
    /// Boxes outside the scene are invisible, the ground is visible everywhere.
    pub fn cast(&self, origin: Point, direction: Point, max_range_m: f64) -> Option<Hit> {
        let ray = Ray::new(origin, direction)?;
        let mut best = self.ground(&ray).filter(|hit| hit.distance_m <= max_range_m);
        self.walk(&ray, max_range_m, &mut best);
        best
    }

    fn ground(&self, ray: &Ray) -> Option<Hit> {
        let distance_m = -ray.origin[2] / ray.direction[2];
        let contact = Contact { distance_m, axis: 2 };
        (distance_m >= 0.0 && distance_m.is_finite())
            .then(|| hit(ray, contact, self.ground_reflectivity, Label::Static))
    }

    /// Visits cells along the ray until no nearer hit is possible.
    fn walk(&self, ray: &Ray, max_range_m: f64, best: &mut Option<Hit>) {
        let Some((entry_m, exit_m)) = self.interval(ray) else { return };
        let mut limit_m = best.map_or(max_range_m, |hit| hit.distance_m).min(exit_m);
        let start = ray.at(entry_m);
        let mut cell = [0_usize; 2];
        let mut next_m = [f64::INFINITY; 2];
        let mut step_m = [f64::INFINITY; 2];
        for axis in 0..2 {
            // A cast of a negative number saturates at 0, the first cell.
            cell[axis] = (((start[axis] - self.min[axis]) / CELL_M) as usize).min(self.cells[axis] - 1);
            let direction = ray.direction[axis];
            if direction != 0.0 {
                let side = cell[axis] + usize::from(direction > 0.0);
                next_m[axis] = (self.min[axis] + side as f64 * CELL_M - ray.origin[axis]) / direction;
                step_m[axis] = CELL_M / direction.abs();
            }
        }
        let mut cell_entry_m = entry_m;
        while cell_entry_m <= limit_m {
            let index = cell[0] + cell[1] * self.cells[0];
            for &member in &self.members[self.starts[index] as usize..self.starts[index + 1] as usize] {
                let solid = &self.solids[member as usize];
                if let Some(contact) = solid.contact(ray)
                    && contact.distance_m <= max_range_m
                    && best.is_none_or(|hit| contact.distance_m < hit.distance_m)
                {
                    limit_m = limit_m.min(contact.distance_m);
                    *best = Some(hit(ray, contact, solid.reflectivity, solid.label));
                }
            }
            let axis = usize::from(next_m[1] < next_m[0]);
            cell_entry_m = next_m[axis];
            next_m[axis] += step_m[axis];
            let moved = if ray.direction[axis] > 0.0 { cell[axis] + 1 } else { cell[axis].wrapping_sub(1) };
            if moved >= self.cells[axis] || step_m[axis].is_infinite() {
                return;
            }
            cell[axis] = moved;
        }
    }

    /// Returns the interval of the ray inside the grid, in metres.
    fn interval(&self, ray: &Ray) -> Option<(f64, f64)> {
        let (mut entry_m, mut exit_m) = (0.0_f64, f64::INFINITY);
        for axis in 0..2 {
            let (min, max) = (self.min[axis], self.min[axis] + self.cells[axis] as f64 * CELL_M);
            let (origin, direction) = (ray.origin[axis], ray.direction[axis]);
            if direction == 0.0 {
                if origin < min || max < origin {
                    return None;
                }
                continue;
            }
            let (to_min, to_max) = ((min - origin) / direction, (max - origin) / direction);
            entry_m = entry_m.max(to_min.min(to_max));
            exit_m = exit_m.min(to_min.max(to_max));
        }
        (entry_m <= exit_m).then_some((entry_m, exit_m))
    }

    /// Returns the first and the last cell along x and y that a box touches.
    fn span(&self, solid: &Solid) -> Option<[(usize, usize); 2]> {
        let along = |axis: usize| {
            let low = (solid.bounds.min[axis] - MARGIN_M - self.min[axis]) / CELL_M;
            let high = (solid.bounds.max[axis] + MARGIN_M - self.min[axis]) / CELL_M;
            // The casts saturate at the first cell.
            let meets = low < self.cells[axis] as f64 && high >= 0.0;
            meets.then(|| (low as usize, (high as usize).min(self.cells[axis] - 1)))
        };
        Some([along(0)?, along(1)?])
    }

    fn each_cell_of(&mut self, solid: &Solid, mut visit: impl FnMut(&mut Self, usize)) {
        let Some([(x0, x1), (y0, y1)]) = self.span(solid) else { return };
        for y in y0..=y1 {
            for x in x0..=x1 {
                visit(self, x + y * self.cells[0]);
            }
        }
    }
}

/// Clamps the radius of a scene; NaN and negative values give 0.
pub(super) fn bounded(radius_m: f64) -> f64 {
    if radius_m > 0.0 { radius_m.min(Scene::MAX_RADIUS_M) } else { 0.0 }
}

fn hit(ray: &Ray, contact: Contact, reflectivity: f64, label: Label) -> Hit {
    let cos_incidence = ray.direction[contact.axis].abs();
    Hit { distance_m: contact.distance_m, reflectivity, cos_incidence, label }
}

#[cfg(test)]
mod tests {
    use super::super::Random;
    use super::*;

    fn random_point(random: &mut Random, reach: [f64; 3]) -> Point {
        std::array::from_fn(|k| random.between(-reach[k], reach[k]))
    }

    #[test]
    fn the_grid_finds_the_same_hits_as_a_test_of_all_boxes() {
        let mut random = Random::of(3, &[]);
        let solids: Vec<Solid> = (0..300)
            .map(|_| {
                let center = random_point(&mut random, [40.0, 40.0, 10.0]);
                let half = random.between(0.05, 3.0);
                Solid::new(center.map(|x| x - half), center.map(|x| x + half), 0.5)
            })
            .collect();
        let scene = Scene::new(solids, 0.2, [0.0; 3], 30.0);
        for _ in 0..5_000 {
            let origin = random_point(&mut random, [60.0, 60.0, 8.0]);
            let mut direction = random_point(&mut random, [1.0; 3]);
            if random.chance(0.2) {
                direction[random.below(3) as usize] = 0.0;
            }
            let Some(ray) = Ray::new(origin, direction) else { continue };
            let boxes = scene.solids.iter().filter_map(|solid| solid.contact(&ray)).map(|c| c.distance_m);
            let ground = scene.ground(&ray).map(|hit| hit.distance_m);
            // Boxes that extend beyond the scene count only inside it.
            let inside = |d: &f64| (0..2).all(|k| ray.at(*d)[k].abs() < 30.0);
            let naive = boxes.filter(inside).chain(ground).filter(|&d| d <= 50.0).min_by(f64::total_cmp);
            let found = scene.cast(origin, direction, 50.0).map(|hit| hit.distance_m);
            if found.is_none_or(|d| inside(&d)) {
                assert_eq!(found, naive, "from {origin:?} along {direction:?}");
            }
        }
    }

    #[test]
    fn extreme_and_invalid_numbers_cause_no_panic() {
        let odd = [0.0, -1.0, 1e300, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE];
        for a in odd {
            for b in odd {
                let solid = Solid::new([a; 3], [b; 3], 0.5);
                let scene = Scene::new(vec![solid], 0.2, [a, b, 1.0], b);
                scene.cast([a, 0.0, 1.0], [b, a, 1.0], a);
                scene.cast([0.0, 0.0, 1.0], [1.0, b, a], b);
            }
        }
    }
}
