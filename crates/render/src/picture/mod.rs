//! Pictures.
//!
//! ```text
//! Picture   what to draw, and how                              options, view
//! Frame     which voxels become which cell                     frame
//! Cells     the best of each cell, whoever comes first         cells, collect
//! Drawing   cells, lines, the sensor's way, legend             drawing, legend, scale
//! Canvas    pixels, boxes, letters                             canvas, font, palette, image
//! OverTime  a local map at several times, side by side         over_time
//! ```

mod canvas;
mod cells;
mod collect;
mod drawing;
mod font;
mod frame;
mod image;
mod legend;
mod options;
mod over_time;
mod palette;
mod scale;
mod view;

pub use drawing::Drawn;
pub use image::Image;
pub use options::Picture;
pub use over_time::{OverTime, Panel};
pub use view::{Change, ColorBy, SideAxis, View};

/// The colors of pictures, as red, green and blue of sRGB.
pub mod colors {
    pub use super::palette::{APPEARED, FREE, PATH, Rgb, SAME, UNKNOWN, VANISHED, color_of};
}
