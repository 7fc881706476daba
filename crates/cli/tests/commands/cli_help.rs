#[cfg(all(feature = "bucket", feature = "view"))]
use crate::cli::voxtile;
use crate::cli::{failure, output, text};
use std::fs;
#[cfg(all(feature = "bucket", feature = "view"))]
use std::path::Path;
use tempfile::TempDir;

/// Returns the commands in the help.
fn commands() -> Vec<String> {
    let help = output(&["help"]);
    let (_, rest) = help.split_once("Commands:\n").unwrap();
    let (list, _) = rest.split_once("\n\n").unwrap();
    let entries = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    entries.map(|line| line.split_whitespace().next().unwrap().to_owned()).collect()
}

#[test]
fn every_completion_script_contains_every_command() {
    let commands = commands();
    assert!(commands.len() > 20, "{commands:?}");
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = output(&["completions", shell]);
        for word in commands.iter().map(String::as_str).chain(["--resolution", "max-range"]) {
            let word = if shell == "fish" { word.trim_start_matches('-') } else { word };
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let (code, printed) = failure(&["completions", "tcsh"]);
    assert!(code == 2 && printed.contains("bash"), "{printed}");
}

#[test]
fn every_command_has_a_man_page() {
    let folder = TempDir::new().unwrap();
    let pages = folder.path().join("share/man1");
    output(&["man", "-o", text(&pages)]);
    let front = fs::read_to_string(pages.join("voxtile.1")).unwrap();
    assert!(front.starts_with(".ie") || front.contains(".TH voxtile 1"), "{front}");
    for command in commands().iter().filter(|command| *command != "help") {
        assert!(front.contains(&command.replace('-', "\\-")), "{command}");
        let page = fs::read_to_string(pages.join(format!("voxtile-{command}.1"))).unwrap();
        let heading = format!(".TH voxtile-{command} 1");
        assert!(page.contains(&heading) && page.contains(".SH SYNOPSIS"), "{page}");
    }
    let occupied = folder.path().join("file");
    fs::write(&occupied, "").unwrap();
    let (code, printed) = failure(&["man", "-o", text(&occupied)]);
    assert!(code == 1 && printed.contains(text(&occupied)), "{printed}");
}

/// Standard output is no terminal, so the default width applies.
#[test]
fn help_fits_in_a_hundred_columns() {
    for command in commands().iter().filter(|command| !["help", "share"].contains(&command.as_str())) {
        for help in [output(&[command, "--help"]), output(&[command, "-h"])] {
            let widest = help.lines().max_by_key(|line| line.chars().count()).unwrap();
            assert!(widest.chars().count() <= 100, "{command}: {widest}");
        }
    }
}

/// Compares the long help of every command with `tests/help/COMMAND.txt`, in 80 columns. Only builds with all commands
/// have these texts.
#[cfg(all(feature = "bucket", feature = "view"))]
#[test]
fn help_equals_its_snapshots() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/help");
    let writes = std::env::var_os("VOXTILE_WRITE_HELP").is_some_and(|value| value == "1");
    let helps = commands().into_iter().filter(|command| command != "help").map(Some).chain([None]);
    let mut files = Vec::new();
    for command in helps {
        let name = format!("{}.txt", command.as_deref().unwrap_or("voxtile"));
        let arguments: Vec<&str> = ["help"].into_iter().chain(command.as_deref()).collect();
        let run = voxtile(&arguments).env_remove("COLUMNS").assert().success();
        let help = String::from_utf8(run.get_output().stdout.clone()).unwrap();
        let path = folder.join(&name);
        if writes {
            fs::write(&path, &help).unwrap();
        }
        let snapshot = fs::read_to_string(&path).unwrap_or_default();
        let line = help.lines().zip(snapshot.lines()).position(|(new, old)| new != old);
        let line = line.unwrap_or_else(|| help.lines().count().min(snapshot.lines().count())) + 1;
        assert!(
            help == snapshot,
            "the help differs from {} from line {line} on; if this is intended, update the files with \
             VOXTILE_WRITE_HELP=1 cargo test -p voxtile-cli --features bucket --test commands help_equals",
            path.display()
        );
        files.push(name);
    }
    for entry in fs::read_dir(&folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        assert!(
            files.contains(&name),
            "{name} is the help of no command; remove it from {}",
            folder.display()
        );
    }
}

#[cfg(not(feature = "bucket"))]
#[test]
fn a_command_missing_in_this_build_names_its_feature() {
    for command in [&["push", "map", "s3://a/b", "--prune"][..], &["pull", "--help"], &["push"]] {
        let (code, printed) = failure(command);
        let named = printed.starts_with(&format!("voxtile: {}: ", command[0]))
            && printed.contains("--features bucket");
        assert!(code == 2 && named, "{printed}");
    }
    assert!(!commands().contains(&"push".to_owned()));
}
