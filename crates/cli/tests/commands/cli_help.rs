use crate::cli::{failure, output, text};
use std::fs;
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
    let (code, said) = failure(&["completions", "tcsh"]);
    assert!(code == 2 && said.contains("bash"), "{said}");
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
    let (code, said) = failure(&["man", "-o", text(&occupied)]);
    assert!(code == 1 && said.contains(text(&occupied)), "{said}");
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

#[cfg(not(feature = "bucket"))]
#[test]
fn a_command_missing_in_this_build_names_its_feature() {
    for command in [&["push", "map", "s3://a/b", "--prune"][..], &["pull", "--help"], &["push"]] {
        let (code, said) = failure(command);
        let named =
            said.starts_with(&format!("voxtile: {}: ", command[0])) && said.contains("--features bucket");
        assert!(code == 2 && named, "{said}");
    }
    assert!(!commands().contains(&"push".to_owned()));
}
