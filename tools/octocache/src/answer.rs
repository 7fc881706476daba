use crate::dataset::Dataset;
use crate::plot::Plot;
use crate::table::Table;
use anyhow::Result;
use std::path::Path;

/// What a question is put to, and how long it may take.
pub struct Setting {
    /// The scans.
    pub datasets: Vec<Dataset>,
    /// Whether to look only whether everything works.
    pub is_short: bool,
    /// Runs of which the median is taken.
    pub runs: usize,
}

/// What a question yields.
pub struct Answer {
    /// Numbers.
    pub tables: Vec<Table>,
    /// The same to look at.
    pub plots: Vec<Plot>,
}

impl Setting {
    /// One of two, the second where the run is to be short.
    pub fn size<T>(&self, full: T, short: T) -> T {
        if self.is_short { short } else { full }
    }
}

impl Answer {
    /// Writes tables and plots into a folder.
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.tables.iter().try_for_each(|table| table.write_csv(folder))?;
        self.plots.iter().try_for_each(|plot| plot.write(folder))
    }

    /// Tables and plots for the page beside the folder `folder`.
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
