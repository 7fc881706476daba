//! Draws pictures of maps, from above, as a slice, from a side, or of the changes between two states, and counts their
//! content. [`levels`] are for viewers that load only what the view needs.
//!
//! A [`Picture`] has the options and draws any [`MapView`](voxtile::MapView): maps on disk, snapshots, maps in memory,
//! OctoMap files. It reads a map tile by tile on the caller's rayon pool and keeps only the cells of the picture and
//! one tile per thread. The image does not depend on the number of threads. The crate does no file or terminal I/O.
//!
//! ```
//! use voxtile_render::{ColorBy, Picture, View};
//! use voxtile::{InMemoryMapper, MapConfig, Mapper, Scan};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut map = InMemoryMapper::new(MapConfig::new(0.1, 10.0)?)?;
//! map.insert_scan(&Scan { origin: [0.0; 3], points: vec![[4.25, 1.05, 0.35]], intensities: None })?;
//!
//! let picture = Picture::new().with_view(View::Slice { z_m: 0.35, thickness_m: 0.2 }).with_title("a wall");
//! let drawn = picture.with_color(ColorBy::Probability).draw(&map, |_done, _all| {})?;
//! let mut png = Vec::new();
//! drawn.image.write_png(&mut png)?;
//! assert!(png.starts_with(b"\x89PNG"));
//! # Ok(())
//! # }
//! ```

pub mod classes;
mod color_map;
mod heights;
mod layer;
pub mod levels;
mod oklab;
mod picture;
mod roof;
#[cfg(test)]
mod sight;
mod survey;

pub use color_map::ColorMap;
pub use heights::height_range_m;
pub use layer::Layer;
pub use picture::{
    Background, Change, ColorBy, Drawing, Drawn, Image, OverTime, Panel, Picture, SideAxis, View, colors,
    is_unix_time, time_labels,
};
pub use roof::Roof;
pub use survey::{HeightBin, Survey};
