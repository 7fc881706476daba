//! Pictures of maps.
//!
//! ```text
//! Picture   options                                            options, view
//! Frame     voxels of each cell                                frame
//! Cells     the best observation of each cell                  cells, layer_cells, collect
//! Drawing   cells, grid, moving points, trajectory             drawing, layout, pane, values, moving, trajectory
//! Legend    axes, scale bar, colors                            legend, labels, scale, time_labels
//! Canvas    pixels, boxes, lines, text                         canvas, typeface, measure, theme, palette, image
//! oblique   views from a direction between above and the side
//! compared  classes of the voxels of two maps, and boxes around changes
//! OverTime  panels of a local map at several times             over_time
//! ```

mod canvas;
mod cells;
mod collect;
mod compared;
mod drawing;
mod frame;
mod image;
mod labels;
mod layer_cells;
mod layout;
mod legend;
mod measure;
mod moving;
mod oblique;
mod options;
mod over_time;
mod palette;
mod pane;
mod scale;
mod theme;
mod time_labels;
mod trajectory;
mod typeface;
mod values;
mod view;

pub use drawing::{Drawing, Drawn};
pub use image::Image;
pub use options::Picture;
pub use over_time::{OverTime, Panel};
pub use theme::Background;
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
