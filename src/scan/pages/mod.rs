//! Marks of the rays of one scan, in pages of 64 x 64 x 64 voxels.
//!
//! A [`Window`] around the sensor finds its pages by one look-up in a table; pages outside are in a hash map. A page
//! has bits if a voxel is updated once per scan ([`MarkedPage`]), and counters if it is updated by each ray
//! ([`CountedPage`]). Ray tracing is generic over both through [`Footprint`].

mod counted_page;
mod footprint;
mod marked_page;
mod page_map;
mod sparse_page;
mod window;

pub(crate) use counted_page::{BrickCounts, CountedPage, MAX_RAYS};
pub(crate) use footprint::Footprint;
pub(crate) use marked_page::{MarkedBrick, MarkedPage, WORDS};
pub(crate) use page_map::PageMap;
pub(crate) use sparse_page::{PAGE_BRICKS, brick_in_page, part_of_place, place_in_page};
pub(crate) use window::{Local, PAGE_EDGE, Window};
