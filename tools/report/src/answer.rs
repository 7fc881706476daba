use crate::plot::Plot;
use crate::table::Table;
use anyhow::Result;
use std::path::Path;

/// What a question yields.
#[derive(Default)]
pub struct Answer {
    /// Numbers.
    pub tables: Vec<Table>,
    /// The same to look at.
    pub plots: Vec<Plot>,
}

impl Answer {
    /// Writes tables and plots into a folder.
    ///
    /// # Errors
    ///
    /// A file that cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.tables.iter().try_for_each(|table| table.write_csv(folder))?;
        self.plots.iter().try_for_each(|plot| plot.write(folder))
    }

    /// Tables and plots for the page beside the folder `folder`, below what was typed and where it ran.
    pub fn markdown(&self, folder: &str, command: &str, machine: &str) -> String {
        let mut text = format!("`{command}`; {machine}.\n");
        for table in &self.tables {
            let Table { caption, file, .. } = table;
            text += &format!("\n{caption} ([CSV]({folder}/{file}.csv))\n");
            if !table.is_only_csv {
                text += &format!("\n{}", table.markdown());
            }
        }
        for plot in &self.plots {
            text +=
                &format!("\n![{caption}]({folder}/{file}.svg)\n", caption = plot.caption, file = plot.file);
        }
        text
    }
}
