//! HTML pages as one file, without scripts and links: `voxtile report`, `voxtile compare --report`.

mod figure;
mod number;
mod page;
mod table;
mod text;

pub use figure::{swatch, write_figure, write_picture};
pub use number::rounded;
pub use page::{begin_page, end_page};
pub use table::{begin_table, end_table, number_cell, row};
pub use text::Text;
