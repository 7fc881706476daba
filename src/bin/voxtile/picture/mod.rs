//! A map seen from above, as a PNG.

mod canvas;
mod font;
mod palette;
mod top_down;

pub use top_down::TopDown;
