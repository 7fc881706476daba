//! A map seen from above, as a PNG that needs no explanation.
//!
//! ```text
//! TopDown   collects voxels in cells, at most a few million     top_down
//! Frame     cells and metres, the length of the scale bar       frame
//! Legend    axes, scale bar, colors                        legend
//! Canvas    pixels, boxes, letters                              canvas, font, palette
//! ```

mod canvas;
mod font;
mod frame;
mod legend;
mod palette;
mod top_down;

pub use top_down::{ColorBy, TopDown, View};
