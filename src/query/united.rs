use super::collision::first_not_free;
use super::occupied_set::check_resolutions;
use super::ray::{EVERYWHERE, Met, voxel_by_voxel, walk_ray, walk_segment};
use super::{Hit, Occupancy, Queries, RayQuery, Shape, UnknownAs, VoxelOccupancy, Voxels};
use crate::error::{Error, Result};
use crate::space::{Aabb, Grid, Point, VoxelIndex};

/// Several maps queried as one, for example a robot's map with its local map or with the layers of other robots.
///
/// A voxel is occupied if it is occupied in any of them, otherwise free if it is free in any, otherwise unknown. If
/// several maps give the same state, the probability of the first is returned.
///
/// ```
/// use voxtile_local::{LocalMap, LocalParameters, Obstacle};
/// use voxtile::query::{Queries, United, UnknownAs};
/// use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan};
///
/// # fn main() -> voxtile::Result<()> {
/// let mut archive = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
/// let mut local = LocalMap::new(0.1, LocalParameters::local_mapping())?;
/// let scan = Scan { origin: [0.0, 0.0, 1.8], points: vec![[4.2, 1.0, 0.3]], intensities: None };
/// archive.insert_scan(&scan)?;
/// local.insert_scan(&scan)?;
/// let view = local.reader().view();
/// let obstacles = view.obstacles(Obstacle::Inflated);
/// let both = United::new(&[&obstacles, &archive])?;
/// assert!(both.cast_segment([0.0, 0.0, 1.8], [4.0, 1.0, 0.3], UnknownAs::Free)?.is_some());
/// # Ok(())
/// # }
/// ```
#[derive(Clone)]
pub struct United<'a> {
    maps: Vec<&'a dyn Queries>,
    grid: Grid,
}

impl std::fmt::Debug for United<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("United").field("maps", &self.maps.len()).field("grid", &self.grid).finish()
    }
}

impl<'a> United<'a> {
    /// Combines maps.
    ///
    /// # Errors
    ///
    /// Fails with [`Error::InvalidArgument`] if there is no map or the maps have different resolutions.
    pub fn new(maps: &[&'a dyn Queries]) -> Result<Self> {
        let Some(first) = maps.first() else {
            return Err(Error::argument("maps", "none given; at least one is needed"));
        };
        check_resolutions(maps.iter().map(|map| map.grid().resolution_m()))?;
        Ok(Self { maps: maps.to_vec(), grid: first.grid() })
    }

    /// Returns the best hit of all maps; `wins` compares a hit with an earlier one.
    fn best(
        &self,
        hits: impl Fn(&dyn Queries) -> Result<Option<Hit>>,
        wins: impl Fn(&Hit, &Hit) -> bool,
    ) -> Result<Option<Hit>> {
        let mut best: Option<Hit> = None;
        for map in &self.maps {
            if let Some(hit) = hits(*map)?
                && best.as_ref().is_none_or(|best| wins(&hit, best))
            {
                best = Some(hit);
            }
        }
        Ok(best)
    }

    /// Returns a function that examines one voxel of a ray, if unknown space is an obstacle.
    fn meet(&self) -> impl FnMut(VoxelIndex) -> Result<Met> {
        |voxel| {
            Ok(match self.occupancy(voxel)? {
                Occupancy::Free(_) => Met::Free,
                other => Met::Obstacle(other.probability()),
            })
        }
    }
}

fn is_before(hit: &Hit, other: &Hit) -> bool {
    hit.distance_m < other.distance_m
}

impl Queries for United<'_> {
    fn grid(&self) -> Grid {
        self.grid
    }

    fn occupancy(&self, voxel: VoxelIndex) -> Result<Occupancy> {
        let mut answer = Occupancy::Unknown;
        for map in &self.maps {
            match map.occupancy(voxel)? {
                occupied @ Occupancy::Occupied(_) => return Ok(occupied),
                free @ Occupancy::Free(_) if answer == Occupancy::Unknown => answer = free,
                _ => {}
            }
        }
        Ok(answer)
    }

    fn voxels_in(&self, region: &Aabb) -> Voxels<'_> {
        let region = *region;
        let voxels = self.maps.iter().enumerate().flat_map(move |(number, map)| {
            map.voxels_in(&region).filter_map(move |voxel| {
                let voxel = match voxel {
                    Ok(VoxelOccupancy { voxel, .. }) => voxel,
                    Err(error) => return Some(Err(error)),
                };
                // Each voxel once, from the first map that contains it.
                for before in &self.maps[..number] {
                    match before.occupancy(voxel) {
                        Ok(Occupancy::Unknown) => {}
                        Ok(_) => return None,
                        Err(error) => return Some(Err(error)),
                    }
                }
                Some(self.occupancy(voxel).map(|occupancy| VoxelOccupancy { voxel, occupancy }))
            })
        });
        Box::new(voxels)
    }

    fn cast_ray(&self, ray: &RayQuery) -> Result<Option<Hit>> {
        match ray.unknown {
            UnknownAs::Free => self.best(|map| map.cast_ray(ray), is_before),
            UnknownAs::Obstacle => walk_ray(&self.grid, ray, Some(EVERYWHERE), voxel_by_voxel(self.meet())),
        }
    }

    fn cast_segment(&self, from: Point, to: Point, unknown: UnknownAs) -> Result<Option<Hit>> {
        match unknown {
            UnknownAs::Free => self.best(|map| map.cast_segment(from, to, unknown), is_before),
            UnknownAs::Obstacle => walk_segment(&self.grid, [from, to], voxel_by_voxel(self.meet())),
        }
    }

    fn collision(&self, body: &Shape, unknown: UnknownAs) -> Result<Option<Hit>> {
        match unknown {
            UnknownAs::Free => self.best(|map| map.collision(body, unknown), |_, _| false),
            UnknownAs::Obstacle => first_not_free(&self.grid, body, |voxel| self.occupancy(voxel)),
        }
    }

    fn nearest_occupied(&self, point: Point, max_distance_m: f64) -> Result<Option<Hit>> {
        let nearest = |map: &dyn Queries| map.nearest_occupied(point, max_distance_m);
        self.best(nearest, |hit, best| hit.is_nearer_than(Some(best)))
    }
}
