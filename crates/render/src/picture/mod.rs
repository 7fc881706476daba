//! Pictures of maps.
//!
//! ```text
//! Picture   options                                            options, view
//! Frame     voxels of each cell                                frame
//! Cells     the best observation of each cell                  cells, layer_cells, collect
//! Drawing   cells, grid, moving points, trajectory, legend     drawing, moving, legend, scale, time_labels
//! Canvas    pixels, boxes, letters                             canvas, font, palette, image
//! compared  classes of the voxels of two maps, and boxes around changes
//! OverTime  panels of a local map at several times             over_time
//! ```

mod canvas;
mod cells;
mod collect;
mod compared;
mod drawing;
mod font;
mod frame;
mod image;
mod layer_cells;
mod legend;
mod moving;
mod options;
mod over_time;
mod palette;
mod scale;
mod time_labels;
mod view;

pub use drawing::{Drawing, Drawn};
pub use image::Image;
pub use options::Picture;
pub use over_time::{OverTime, Panel};
pub use time_labels::{is_unix_time, time_labels};
pub use view::{Change, ColorBy, SideAxis, View};

/// Colors of pictures, as red, green and blue in sRGB.
pub mod colors {
    pub use super::compared::comparison_color;
    pub(crate) use super::palette::mixed;
    pub use super::palette::{
        APPEARED, FREE, MOVING, NO_VALUE, NOT_SEEN, PATH, Rgb, SAME, UNCERTAIN, UNCHANGED, UNKNOWN, VANISHED,
        color_of,
    };
}
