use super::ray_end::RayEnd;
use super::ray_origin::RayOrigin;
use super::slab_ray::SlabRay;
use super::slab_span::SlabSpan;
use crate::scan::pages::{Local, Window};
use crate::space::{Grid, Point, TileBox, TileIndex, TileSelection, VoxelBox, VoxelIndex};

/// Clips the rays of a scan to the selected tiles before they are traced.
///
/// A clipped ray is one run of slabs. It contains each voxel of a selected tile that [`RayWalk`](super::RayWalk)
/// visits, and some others at its ends and between selected tiles, which the collector of the marks must filter out.
#[derive(Clone, Debug)]
pub(crate) struct RayCut<'a> {
    grid: &'a Grid,
    tiles: &'a TileSelection,
    /// Box around the selected tiles, relative to the origin, in units of voxels and enlarged by [`MARGIN`] on all
    /// sides; `None` if no tile is selected.
    around: Option<(Point, Point)>,
    /// Box of the ends of all rays that may reach `around`. Along each axis on which the origin is outside of `around`,
    /// it is bounded by the near side of `around`; otherwise it is unbounded.
    ends: (Point, Point),
    /// Voxels of a box around the selected tiles.
    voxels: VoxelBox,
}

/// In voxels; far above the rounding error of a ray.
const MARGIN: f64 = 1.0;

impl<'a> RayCut<'a> {
    pub(crate) fn new(grid: &'a Grid, tiles: &'a TileSelection, origin: &RayOrigin) -> Self {
        let around = tiles.bounds().map(|bounds| {
            let edge = f64::from(grid.voxels_per_tile_edge());
            let (low, high) = (bounds.min().to_array(), bounds.max().to_array());
            (
                std::array::from_fn(|k| f64::from(low[k]) * edge - MARGIN - origin.point[k]),
                std::array::from_fn(|k| (f64::from(high[k]) + 1.0) * edge + MARGIN - origin.point[k]),
            )
        });
        let voxels = match tiles.bounds() {
            Some(bounds) => VoxelBox {
                min: grid.voxels_of_tile(bounds.min()).min,
                end: grid.voxels_of_tile(bounds.max()).end,
            },
            None => VoxelBox { min: [0; 3], end: [0; 3] },
        };
        let (low, high) = around.unwrap_or_default();
        let end_at = |k: usize, side: f64| origin.point[k] + side;
        let ends = (
            std::array::from_fn(|k| if low[k] > 0.0 { end_at(k, low[k]) } else { f64::NEG_INFINITY }),
            std::array::from_fn(|k| if high[k] < 0.0 { end_at(k, high[k]) } else { f64::INFINITY }),
        );
        Self { grid, tiles, around, ends, voxels }
    }

    /// Returns the clipped ray to `end`; `None` if it crosses no selected tile.
    #[inline]
    pub(crate) fn apply(&self, origin: &RayOrigin, end: RayEnd) -> Option<RayEnd> {
        // Most rays end close to the sensor: a cheap test rejects those that do not reach the selected tiles.
        if (0..3).any(|k| end.point[k] < self.ends.0[k] || end.point[k] > self.ends.1[k]) {
            return None;
        }
        let span = self.span(&SlabRay::new(origin, end));
        let hit = end.hit.filter(|_| self.tiles.contains(self.grid.tile_of_voxel(end.voxel)));
        match (span, hit) {
            (None, None) => None,
            (span, hit) => Some(RayEnd { hit, span: span.unwrap_or(SlabSpan::WHOLE), ..end }),
        }
    }

    /// Returns whether a condition holds for the selected voxels from `low` to `high`, both in the window. It is
    /// evaluated for boxes of these voxels, also given by their lowest and highest voxel.
    pub(crate) fn for_all_selected(
        &self,
        window: &Window,
        low: Local,
        high: Local,
        mut holds: impl FnMut(Local, Local) -> bool,
    ) -> bool {
        let base = window.base();
        let voxel = |local: Local, k: usize| base[k] + local[k] as i32;
        let wanted = VoxelBox {
            min: std::array::from_fn(|k| voxel(low, k)),
            // Adding 1 cannot overflow: a window ends before the last voxel of the index range.
            end: std::array::from_fn(|k| voxel(high, k) + 1),
        };
        let wanted = wanted.intersection(&self.voxels);
        if wanted.is_empty() {
            return true;
        }
        let mut holds_in = |region: &VoxelBox| {
            let local = |voxel: i32, k: usize| voxel.wrapping_sub(base[k]) as u32;
            holds(
                std::array::from_fn(|k| local(region.min[k], k)),
                std::array::from_fn(|k| local(region.end[k] - 1, k)),
            )
        };
        if self.tiles.is_box() {
            return holds_in(&wanted);
        }
        let last: VoxelIndex = wanted.end.map(|end| end - 1);
        let tiles = TileBox::new(self.grid.tile_of_voxel(wanted.min), self.grid.tile_of_voxel(last));
        let mut selected = tiles.tiles().filter(|tile| self.tiles.contains(*tile));
        selected.all(|tile| holds_in(&wanted.intersection(&self.grid.voxels_of_tile(tile))))
    }

    fn span(&self, ray: &SlabRay) -> Option<SlabSpan> {
        let (low, high) = self.around?;
        // Times along the ray, from 0 at the origin to 1 at the end.
        let (mut enter, mut leave) = (0.0_f64, 1.0_f64);
        for k in 0..3 {
            let inverse = 1.0 / ray.direction[k];
            let (first, second) = (low[k] * inverse, high[k] * inverse);
            // A ray along a border of the box gives NaN, which `max` and `min` ignore. This is correct, because the
            // selected tiles are at a distance of a margin from the border.
            enter = enter.max(first.min(second));
            leave = leave.min(first.max(second));
        }
        if enter > leave {
            return None;
        }
        let longest = ray.direction[ray.axis].abs();
        let span = SlabSpan {
            from: ((enter * longest) as u32).saturating_sub(2),
            until: ((leave * longest) as u32).saturating_add(3),
        };
        if self.tiles.is_box() || !ray.per_slab.is_finite() {
            return Some(span);
        }
        match ray.axis {
            0 => self.narrowed::<0, 1, 2>(ray, span),
            1 => self.narrowed::<1, 0, 2>(ray, span),
            _ => self.narrowed::<2, 0, 1>(ray, span),
        }
    }

    /// Returns the first and last slab of a span in which the ray may be in a selected tile. The span is examined layer
    /// by layer of tiles, along the axis `A` of the ray's largest component.
    fn narrowed<const A: usize, const B: usize, const C: usize>(
        &self,
        ray: &SlabRay,
        span: SlabSpan,
    ) -> Option<SlabSpan> {
        let edge = i64::from(self.grid.voxels_per_tile_edge());
        let is_up = ray.direction[A] > 0.0;
        let sensor = i64::from(ray.origin.voxel[A]);
        let end = span.until.min(ray.slabs().saturating_add(1));
        let (mut from, mut found) = (span.from, None);
        while from < end {
            // The layer of tiles that contains the slab `from`, and the first slab after it.
            let slab = if is_up { sensor + i64::from(from) } else { sensor - i64::from(from) };
            let layer = slab.div_euclid(edge);
            let after = if is_up { (layer + 1) * edge - sensor } else { sensor - layer * edge + 1 };
            let until = u32::try_from(after).unwrap_or(end).min(end);
            if self.may_pass_selected::<A, B, C>(ray, layer as i32, (from, until)) {
                found = Some(SlabSpan { from: found.map_or(from, |span: SlabSpan| span.from), until });
            }
            from = until;
        }
        // If the last slab of the ray is included, the end of the span is kept: nothing is clipped after it.
        found.map(|found| if found.until == end { SlabSpan { until: span.until, ..found } } else { found })
    }

    /// Returns whether the ray may be in a selected tile of a layer in these slabs.
    fn may_pass_selected<const A: usize, const B: usize, const C: usize>(
        &self,
        ray: &SlabRay,
        layer: i32,
        (from, until): (u32, u32),
    ) -> bool {
        let edge = i64::from(self.grid.voxels_per_tile_edge());
        // Distances along `A` at which the ray may be in these slabs.
        let (near, far) = (f64::from(from.saturating_sub(1)), f64::from(until));
        let tiles_along = |axis: usize| {
            let slope = ray.direction[axis] * ray.per_slab;
            let at = |distance: f64| ray.origin.point[axis] + slope * distance;
            let (low, high) = (at(near).min(at(far)) - MARGIN, at(near).max(at(far)) + MARGIN);
            let tile = |at: f64| (at.floor() as i64).div_euclid(edge) as i32;
            tile(low)..=tile(high)
        };
        let (along_b, along_c) = (tiles_along(B), tiles_along(C));
        let is_selected = |b: i32, c: i32| {
            let mut tile = [0; 3];
            (tile[A], tile[B], tile[C]) = (layer, b, c);
            self.tiles.contains(TileIndex::from(tile))
        };
        along_b.into_iter().any(|b| along_c.clone().any(|c| is_selected(b, c)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rays in all directions from one origin, each with the first and last slab in which it visits selected tiles.
    fn rays(origin: &RayOrigin, grid: &Grid, tiles: &TileSelection) -> Vec<(RayEnd, Option<(u32, u32)>)> {
        let ray = |k: u32| {
            let (azimuth, up) = (f64::from(k) * 2.399_963, f64::from(k % 199) / 99.0 - 1.0);
            let (flat, reach) = ((1.0 - up * up).max(0.0).sqrt(), 40.0 + f64::from(k % 997));
            let way = [flat * azimuth.cos(), flat * azimuth.sin(), up];
            let point: Point = std::array::from_fn(|axis| origin.point[axis] + reach * way[axis]);
            let voxel = point.map(|x| x.floor() as i32);
            let end = RayEnd { point, voxel, hit: None, span: SlabSpan::WHOLE };
            let ray = SlabRay::new(origin, end);
            let mut visited = None;
            ray.walk().for_each_before_end(|voxel| {
                if tiles.contains(grid.tile_of_voxel(voxel)) {
                    let slab = voxel[ray.axis].abs_diff(origin.voxel[ray.axis]);
                    visited = Some((visited.map_or(slab, |(first, _)| first), slab));
                }
            });
            (end, visited)
        };
        (0..3000).map(ray).collect()
    }

    #[test]
    fn clipped_rays_contain_the_selected_tiles_and_few_other_voxels() {
        let grid = Grid::new(0.1, 10.0).unwrap();
        let near = TileBox::new([1, -2, -1].into(), [3, 0, 0].into());
        let selections: [TileSelection; 4] = [
            near.into(),
            near.tiles().collect(),
            TileBox::new([0, 0, 0].into(), [0, 0, 0].into()).into(),
            [TileIndex::new(-6, 2, 0), TileIndex::new(-6, 3, 0)].into_iter().collect(),
        ];
        for point in [[3.5, 40.25, 7.125], [17.0, 99.0, 60.0]] {
            let origin = &RayOrigin::new(point, point.map(|x| x.floor() as i32));
            for tiles in &selections {
                let cut = RayCut::new(&grid, tiles, origin);
                let (mut wanted, mut left) = (0, 0);
                for (end, visited) in rays(origin, &grid, tiles) {
                    let span = cut.apply(origin, end).map(|end| end.span);
                    if let Some((first, last)) = visited {
                        let span = span.unwrap();
                        assert!(span.from <= first && last < span.until, "{end:?}: {span:?}");
                        wanted += last - first + 1;
                    }
                    let slabs = SlabRay::new(origin, end).slabs() + 1;
                    left += span.map_or(0, |span| span.until.min(slabs) - span.from);
                }
                assert!(wanted > 0 && left < wanted + wanted / 5, "{left} slabs for {wanted}: {tiles:?}");
            }
        }
    }
}
