//! Pictures of maps, and numbers to go with them: from above, cut at a height, from a side, or what became of one state
//! on the way to another. [`levels`] are for viewers that load only what is near.
//!
//! A [`Picture`] says what to draw and how; it draws anything that is a [`MapView`](voxtile::MapView): maps on disk,
//! snapshots, maps in memory, files of OctoMap. It reads a map of any size tile by tile, on the threads of the caller's
//! rayon pool, and keeps the cells of the picture and one tile a thread. The picture is the same to the byte for any
//! number of threads. Nothing here knows a terminal, a page or a file.
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

pub mod levels;
mod picture;
mod survey;

pub use picture::{Change, ColorBy, Drawn, Image, OverTime, Panel, Picture, SideAxis, View, colors};
pub use survey::{HeightBin, Survey};
