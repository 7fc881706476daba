//! Runs the commands of the documents: the tutorial from top to bottom, and the README's example with its output.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Begins a comment before a block that the test does not run, followed by the reason.
const SKIP: &str = "<!-- not run by the test: ";

/// A fenced block of a page.
struct Block {
    /// Number of its first line, counted from 1.
    line: usize,
    language: String,
    text: String,
    /// Reason for not running it, if any.
    skipped: Option<String>,
}

fn page(path: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)).unwrap()
}

fn blocks(page: &str) -> Vec<Block> {
    let mut blocks: Vec<Block> = Vec::new();
    let (mut is_inside, mut before) = (false, "");
    for (number, line) in page.lines().enumerate() {
        match line.strip_prefix("```") {
            Some(language) if !is_inside => {
                let reason = before.strip_prefix(SKIP).and_then(|rest| rest.strip_suffix(" -->"));
                let (language, skipped) = (language.to_owned(), reason.map(str::to_owned));
                blocks.push(Block { line: number + 2, language, text: String::new(), skipped });
                is_inside = true;
            }
            Some(_) => is_inside = false,
            None if is_inside => blocks.last_mut().unwrap().text += &format!("{line}\n"),
            None => {}
        }
        before = line;
    }
    blocks
}

/// Folder of the program `voxtile`, which `cargo test --workspace` builds. Prints a line and returns `None` if it is
/// missing.
fn programs() -> Option<PathBuf> {
    let folder = Path::new(env!("CARGO_BIN_EXE_workload")).parent().unwrap();
    if folder.join("voxtile").is_file() {
        return Some(folder.to_owned());
    }
    println!("skipped: voxtile is missing in {}; cargo test --workspace builds it", folder.display());
    None
}

/// Runs the shell blocks of a page in one script, in a temporary folder, which it returns.
fn run_blocks(path: &str, programs: &Path, is_run: impl Fn(&Block) -> bool) -> tempfile::TempDir {
    let mut script = String::new();
    for block in blocks(&page(path)).iter().filter(|block| is_run(block)) {
        let Block { line, language, text, skipped } = block;
        match skipped {
            None if language == "sh" => script += &format!("at={line}\n{text}"),
            reason => {
                let reason = reason.clone().unwrap_or(format!("a block of {language}"));
                println!("{path}:{line}: skipped: {reason}");
            }
        }
    }
    assert!(script.contains("voxtile export"), "{script}");

    let folder = tempfile::tempdir().unwrap();
    let programs = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    // The script ends at the first error, also on the left of a pipe. A timeout ends commands that are repeated until
    // they succeed.
    let head = format!("trap 'echo \"{path}: the block at line $at fails: $BASH_COMMAND\" >&2' ERR\n");
    let run = Command::new("timeout")
        .args(["600", "bash", "-Eeuo", "pipefail", "-c", &format!("{head}{script}")])
        .current_dir(folder.path())
        .env("PATH", programs)
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{}: {errors}", run.status);
    folder
}

#[test]
fn the_tutorial_runs_from_top_to_bottom() {
    let Some(programs) = programs() else { return };
    let folder = run_blocks("docs/tutorial.md", &programs, |_| true);
    // The files that exist afterwards according to the page.
    for file in ["voxtile_demo/map.png", "walls.ply", "city.bt", "moved.bt.origin.json"] {
        assert!(folder.path().join("tutorial").join(file).is_file(), "{file}");
    }
}

#[test]
fn the_readmes_commands_run_in_the_printed_order() {
    let Some(programs) = programs() else { return };
    let folder = run_blocks("README.md", &programs, |block| block.text.starts_with("voxtile "));
    for file in ["voxtile_demo/map.png", "slice.png", "report.html", "occupied.ply"] {
        assert!(folder.path().join(file).is_file(), "{file}");
    }
}

#[test]
fn the_readmes_example_gives_the_printed_output() {
    let Some(programs) = programs() else { return };
    let readme = page("README.md");
    let examples: Vec<Block> =
        blocks(&readme).into_iter().filter(|block| block.language == "console").collect();
    assert!(!examples.is_empty());
    for Block { line, text, .. } in examples {
        let (command, answer) = text.split_once('\n').unwrap();
        let command = command.strip_prefix("$ voxtile ").unwrap();
        let run = Command::new(programs.join("voxtile"))
            .args(command.split(' '))
            .current_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../.."))
            .output()
            .unwrap();
        assert!(run.status.success(), "README.md:{line}");
        assert_eq!(String::from_utf8_lossy(&run.stdout), answer, "README.md:{line}");
    }
}
