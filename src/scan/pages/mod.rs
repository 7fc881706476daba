//! Where the rays of one scan leave their marks: pages of 64 x 64 x 64 voxels.
//!
//! A [`Window`] around the sensor finds its pages by one look-up in a table; pages outside are in a hash map. A page
//! holds bits where a voxel counts once per scan ([`MarkedPage`]), and counters where every ray counts
//! ([`CountedPage`]). A ray knows either only as a [`Footprint`].

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
pub(crate) use sparse_page::{brick_in_page, part_of_place, place_in_page};
pub(crate) use window::{Local, PAGE_EDGE, Window};
