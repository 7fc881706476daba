//! Plots as SVG files: panels side by side, with lines or bars.

mod axis;
mod draw;
mod panel;

pub use axis::Scale;
pub use draw::Plot;
pub use panel::{Bars, Content, Line, Panel};
