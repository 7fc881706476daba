//! A map seen from above, as a PNG that needs no explanation.
//!
//! ```text
//! TopDown   collects voxels in cells, at most a few million     top_down
//! Frame     cells and metres, the length of the scale bar       frame
//! OverTime  a local map at several times, side by side         over_time
//! Legend    axes, scale bar, colors                        legend
//! Canvas    pixels, boxes, letters                              canvas, font, palette
//! ```

mod canvas;
mod font;
mod frame;
mod legend;
mod over_time;
mod palette;
mod top_down;

pub use over_time::{OverTime, Panel};
pub use top_down::{ColorBy, TopDown, View};
