//! Point clouds in files, one format a file.
//!
//! [`open`] takes a file or a folder; [`Format::guess`] looks at what is in it. Each format is a [`crate::clouds::CloudSource`]:
//! files with one cloud (PLY, text, `.bin`), with several (LAS cut by GPS time, E57), and folders of either.

mod bin;
mod columns;
mod depth_frames;
mod depth_images;
mod depth_tum;
#[cfg(feature = "e57")]
mod e57;
#[cfg(feature = "e57")]
mod e57_packets;
#[cfg(feature = "e57")]
mod e57_pages;
mod files;
mod foreign;
mod format;
mod from_origin;
mod glance;
mod intrinsics;
#[cfg(feature = "las")]
mod las;
#[cfg(feature = "las")]
mod las_layout;
#[cfg(feature = "las")]
mod las_points;
#[cfg(feature = "las")]
mod las_record;
#[cfg(feature = "las")]
mod las_scans;
#[cfg(feature = "las")]
mod las_trimmed;
#[cfg(feature = "las")]
mod las_units;
#[cfg(feature = "las")]
mod laz_chunks;
mod listing;
mod one;
mod open;
mod options;
mod ply;
mod ply_header;
mod regular;
mod scalar;
mod text;
mod text_line;
#[cfg(any(feature = "las", feature = "e57"))]
mod wkt;
#[cfg(feature = "e57")]
mod xml_check;

pub use format::Format;
pub use from_origin::FromOrigin;
pub use intrinsics::Intrinsics;
pub use open::open;
pub use options::OpenOptions;
