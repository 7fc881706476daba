use crate::answer::Answer;
use crate::machine;
use anyhow::{Context, Result, anyhow, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// A page in Markdown with measured sections, and next to it the folder of their tables and plots.
#[derive(Debug)]
pub struct Page {
    path: PathBuf,
    folder: PathBuf,
}

impl Page {
    /// Opens the page `source`, or a copy of it at `output`, to which results are then written.
    ///
    /// # Errors
    ///
    /// Fails if the page cannot be read or the copy or folder cannot be created.
    pub fn open(source: &Path, output: Option<&Path>) -> Result<Self> {
        let path = output.unwrap_or(source).to_owned();
        let folder = path.with_extension("");
        fs::create_dir_all(&folder)
            .with_context(|| format!("{}: cannot create the folder", folder.display()))?;
        let page = Self { path, folder };
        if page.path != source {
            page.write(&read(source)?)?;
        }
        Ok(page)
    }

    /// Folder of tables and plots.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Writes an answer into its section, and its files into the folder. `command` is the command that repeats the
    /// measurement.
    ///
    /// Reads the page each time, so that edits during a long run are kept.
    ///
    /// # Errors
    ///
    /// Fails if a file cannot be read or written, or if the page lacks the marks of the section.
    pub fn put(&self, section: &str, answer: &Answer, command: &str) -> Result<()> {
        answer.write(&self.folder)?;
        let name = self.folder.file_name().and_then(|name| name.to_str());
        let name =
            name.ok_or_else(|| anyhow!("{}: the name of the folder must be UTF-8", self.folder.display()))?;
        let text = answer.markdown(name, command, &machine::description());
        let page = with_section(&read(&self.path)?, section, &text);
        self.write(&page.with_context(|| self.path.display().to_string())?)
    }

    fn write(&self, text: &str) -> Result<()> {
        fs::write(&self.path, text).with_context(|| format!("{}: cannot write the page", self.path.display()))
    }
}

fn read(page: &Path) -> Result<String> {
    fs::read_to_string(page).with_context(|| format!("{}: cannot read the page", page.display()))
}

/// Replaces the text between the marks of a section.
fn with_section(page: &str, section: &str, text: &str) -> Result<String> {
    let (begin, end) = (format!("<!-- {section}: measured -->\n"), format!("<!-- {section}: end -->\n"));
    for mark in [&begin, &end] {
        let count = page.matches(mark.as_str()).count();
        ensure!(count == 1, "{} occurs {count} times in the page; it must occur once", mark.trim_end());
    }
    let (before, rest) = page.split_once(&begin).unwrap_or_default();
    let Some((_, after)) = rest.split_once(&end) else {
        anyhow::bail!("{} occurs before {} in the page", end.trim_end(), begin.trim_end());
    };
    Ok([before, &begin, text, &end, after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::table::Table;

    const PAGE: &str = "# A\n<!-- a: measured -->\nold\n<!-- a: end -->\nprose\n";

    #[test]
    fn only_the_section_is_replaced() {
        let page = with_section(PAGE, "a", "new\n").unwrap();
        assert_eq!(page, PAGE.replace("old", "new"));
        assert_eq!(with_section(&page, "a", "old\n").unwrap(), PAGE);
    }

    #[test]
    fn missing_double_and_swapped_marks_are_errors() {
        assert!(with_section(PAGE, "b", "").is_err());
        assert!(with_section(&PAGE.repeat(2), "a", "").is_err());
        assert!(with_section("<!-- a: end -->\n<!-- a: measured -->\n", "a", "").is_err());
    }

    #[test]
    fn an_answer_is_written_to_the_copy_only() {
        let folder = tempfile::tempdir().unwrap();
        let (source, output) = (folder.path().join("page.md"), folder.path().join("copy.md"));
        fs::write(&source, PAGE).unwrap();
        let page = Page::open(&source, Some(&output)).unwrap();
        let mut table = Table::new("numbers", "Some.", ["n"]);
        table.push([7.into()]);
        page.put("a", &Answer { tables: vec![table], plots: Vec::new() }, "measure").unwrap();
        assert_eq!(fs::read_to_string(&source).unwrap(), PAGE);
        let text = fs::read_to_string(&output).unwrap();
        assert!(text.contains("`measure`; ") && text.contains("Some. ([CSV](copy/numbers.csv))"), "{text}");
        assert!(page.folder().join("numbers.csv").is_file());
        assert!(page.put("b", &Answer::default(), "measure").is_err());
    }
}
