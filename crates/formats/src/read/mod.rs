//! Readers of point cloud files, one format per file.
//!
//! Each format is a [`CloudSource`]: files with one cloud (PLY, text, `.bin`), files with several (LAS split by GPS
//! time, E57), and folders of either.

pub(crate) mod attribute_columns;
pub(crate) mod bin;
mod bin_columns;
pub(crate) mod cloud;
mod colour_image;
mod colour_list;
mod columns;
pub(crate) mod companions;
pub(crate) mod crs_unit;
pub(crate) mod depth;
mod depth_frames;
pub(crate) mod depth_images;
pub(crate) mod depth_tum;
#[cfg(feature = "e57")]
pub(crate) mod e57;
#[cfg(feature = "e57")]
mod e57_packets;
#[cfg(feature = "e57")]
mod e57_pages;
pub(crate) mod file_order;
pub(crate) mod files;
pub(crate) mod foreign;
pub(crate) mod from_origin;
pub(crate) mod glance;
pub(crate) mod gray16;
pub(crate) mod guard;
mod input_file;
pub(crate) mod inside;
mod intrinsics;
mod label_file;
#[cfg(feature = "las")]
pub(crate) mod las;
#[cfg(feature = "las")]
mod las_colours;
#[cfg(feature = "las")]
mod las_count;
#[cfg(feature = "las")]
mod las_hints;
#[cfg(feature = "las")]
mod las_layout;
#[cfg(feature = "las")]
mod las_points;
#[cfg(feature = "las")]
mod las_record;
#[cfg(feature = "las")]
mod las_records;
#[cfg(feature = "las")]
mod las_scans;
#[cfg(feature = "las")]
mod las_units;
#[cfg(feature = "las")]
mod laz_chunks;
#[cfg(feature = "las")]
mod laz_head;
#[cfg(feature = "las")]
mod laz_points;
pub(crate) mod lines;
pub(crate) mod listing;
mod lzf;
pub(crate) mod name_stamps;
pub(crate) mod of_classes;
pub(crate) mod one;
mod pcd;
pub(crate) mod pcd_header;
pub(crate) mod pcd_scans;
pub(crate) mod ply;
pub(crate) mod ply_header;
mod ply_rows;
mod points;
pub(crate) mod regular;
pub(crate) mod scalar;
pub(crate) mod scan_graph;
pub(crate) mod scan_log;
pub(crate) mod scan_stream;
mod skipped_rows;
pub(crate) mod stamp;
mod stream_input;
pub(crate) mod text;
mod text_columns;
mod text_header;
pub(crate) mod text_line;
pub(crate) mod units;
mod wkt;
#[cfg(feature = "e57")]
mod xml_check;

pub use attribute_columns::AttributeValues;
pub use cloud::{CloudHead, CloudPoint, CloudSource, PoseAt};
pub use input_file::open_input;
pub use intrinsics::Intrinsics;
pub use name_stamps::in_name as stamp_of_name;
pub use one::{Points, Visit};
pub use pcd::read_pcd;
pub use points::read_points;
pub use scan_graph::read_scan_graph;
pub use scan_log::read_scan_log;
pub use scan_stream::{read_scan_stream, read_scan_stream_with};
