use crate::plot::Plot;
use crate::table::Table;
use anyhow::Result;
use std::path::Path;
use textwrap::{Options, WordSplitter};

/// Result of a question.
#[derive(Default)]
pub struct Answer {
    /// Tables.
    pub tables: Vec<Table>,
    /// Plots.
    pub plots: Vec<Plot>,
}

impl Answer {
    /// Writes tables and plots into a folder.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be written.
    pub fn write(&self, folder: &Path) -> Result<()> {
        self.tables.iter().try_for_each(|table| table.write_csv(folder))?;
        self.plots.iter().try_for_each(|plot| plot.write(folder))
    }

    /// Text with tables and plots for the page, after the command and the machine. `folder` is the folder of the files,
    /// next to the page.
    pub fn markdown(&self, folder: &str, command: &str, machine: &str) -> String {
        let mut text = wrapped(&format!("`{command}`; {machine}."));
        for table in &self.tables {
            let Table { caption, file, .. } = table;
            text += &format!("\n{}", wrapped(&format!("{caption} ([CSV]({folder}/{file}.csv))")));
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

/// Maximum length of a line of prose.
const LINE_WIDTH: usize = 120;

/// Wraps a paragraph at [`LINE_WIDTH`] characters; a longer word gets its own line.
fn wrapped(paragraph: &str) -> String {
    let options = Options::new(LINE_WIDTH).break_words(false).word_splitter(WordSplitter::NoHyphenation);
    textwrap::fill(paragraph, options) + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prose_is_wrapped_between_words_and_complete() {
        let caption = "Bytes of a long-lived map, by flush, and what readers see of it. ".repeat(6);
        let table = Table::new("a_file", caption.clone(), ["a column"]);
        let text =
            Answer { tables: vec![table], plots: Vec::new() }.markdown("folder", "a command", "a machine");
        assert!(text.lines().all(|line| line.len() <= LINE_WIDTH), "{text}");
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        let expected =
            format!("`a command`; a machine. {caption} ([CSV](folder/a_file.csv)) | a column | | ---: |");
        assert_eq!(words(&text), words(&expected));
        let long_word = "w".repeat(200);
        assert_eq!(wrapped(&format!("a {long_word} z")), format!("a\n{long_word}\nz\n"));
    }
}
