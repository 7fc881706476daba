use crate::cli::{scans, text, voxtile};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// Settings of the log, with texts that the log must and must not contain.
struct Case {
    options: &'static [&'static str],
    rust_log: Option<&'static str>,
    flushes: bool,
    tiles: bool,
}

const fn case(options: &'static [&'static str], rust_log: Option<&'static str>, text_out: [bool; 2]) -> Case {
    Case { options, rust_log, flushes: text_out[0], tiles: text_out[1] }
}

const CASES: [Case; 11] = [
    case(&[], None, [false, false]),
    case(&["-q"], None, [false, false]),
    case(&["--quiet"], Some("debug"), [false, false]),
    case(&["-v"], None, [true, false]),
    case(&["--verbose"], Some("off"), [true, false]),
    case(&["-vv"], None, [true, true]),
    case(&["-v", "-v"], None, [true, true]),
    case(&["-vvv"], Some("error"), [true, true]),
    case(&[], Some("info"), [true, false]),
    case(&[], Some("debug"), [true, true]),
    case(&[], Some("voxtile::mapper=debug"), [false, true]),
];

/// Returns exit code, standard output and standard error.
fn run(arguments: &[&str], case: &Case) -> (i32, String, String) {
    let mut command = voxtile(&[arguments, case.options].concat());
    command.env_remove("RUST_LOG");
    if let Some(filter) = case.rust_log {
        command.env("RUST_LOG", filter);
    }
    let output = command.output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Builds with tiles of two metres, two of them in memory, so that tiles are evicted and loaded.
fn build(scans: &Path, map: &Path, case: &Case) -> (String, String) {
    let small = ["--resolution", "0.1", "--tile-size", "2", "--cache-tiles", "2", "--flush-every", "1"];
    let build = [&["build", text(scans), "-o", text(map)][..], &small].concat();
    let (code, out, text_out) = run(&build, case);
    assert_eq!(code, 0, "{text_out}");
    (out, text_out)
}

/// Returns whether a run prints only errors and results.
fn is_quiet(case: &Case) -> bool {
    matches!(case.options, ["-q" | "--quiet"])
}

/// Returns the output of a build without times and the map's name.
fn lasting(out: &str) -> Vec<&str> {
    let is_lasting =
        |line: &&str| ["points", "skipped", "voxels", "tiles "].iter().any(|word| line.starts_with(word));
    let lines: Vec<&str> = out.lines().filter(is_lasting).collect();
    assert!(lines.len() > 3, "{out}");
    lines
}

#[test]
fn options_and_environment_change_only_the_log() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let mut before: Option<(String, PathBuf)> = None;
    for (number, case) in CASES.iter().enumerate() {
        let what = format!("{:?}, RUST_LOG {:?}", case.options, case.rust_log);
        let map = folder.path().join(format!("map{number}"));
        let (out, text_out) = build(&scans, &map, case);
        for (word, is_said) in
            [(": flush ", case.flushes), (": loaded", case.tiles), (": evicted", case.tiles)]
        {
            assert_eq!(text_out.contains(word), is_said, "{what}: {word}: {text_out}");
        }
        assert!(case.flushes || case.tiles || text_out.is_empty(), "{what}: {text_out}");
        let (earlier, earlier_map) = before.get_or_insert_with(|| (out.clone(), map.clone()));
        match is_quiet(case) {
            true => assert_eq!(out, "", "{what}"),
            false => assert_eq!(lasting(&out), lasting(earlier), "{what}"),
        }
        // The output of a command without times is identical.
        let ask = |map: &Path, case| {
            let (code, out, text_out) = run(&["query", text(map), "4.1", "-0.5", "0.6", "--json"], case);
            assert_eq!((code, text_out.as_str()), (0, ""), "{what}");
            out
        };
        assert_eq!(ask(&map, case), ask(earlier_map, &CASES[0]), "{what}");
        let digest = |map: &Path| run(&["digest", text(map)], case).1;
        assert_eq!(digest(&map), digest(earlier_map), "{what}");
    }
}

#[test]
fn quiet_suppresses_warnings_and_summaries_but_no_errors() {
    let folder = TempDir::new().unwrap();
    let scans = scans(&folder);
    let map = folder.path().join("map");
    let [loud, quiet] = [&CASES[0], &CASES[1]];
    build(&scans, &map, loud);
    let merged = |name: &str| folder.path().join(name);
    let merge = |into: &Path, case| run(&["merge", text(&map), text(&map), "-o", text(into), "--json"], case);
    let (_, out, text_out) = merge(&merged("loud"), loud);
    assert!(text_out.contains("counts twice") && out.contains("counts twice"), "{text_out}");
    let (_, out, text_out) = merge(&merged("quiet"), quiet);
    assert!(text_out.is_empty() && out.contains("counts twice"), "{text_out}");
    // Without JSON no summaries are printed, but results are.
    let plain = |arguments: &[&str]| run(arguments, quiet);
    for work in [
        &["crop", text(&map), "-o", text(&merged("crop")), "--region", "0", "0", "0", "5", "5", "5"][..],
        &["export", text(&map), "-o", text(&merged("a.ply"))],
        &["picture", text(&map), "-o", text(&merged("a.png"))],
        &["snapshot", text(&map), "before"],
        &["report", text(&map), "-o", text(&merged("a.html"))],
    ] {
        assert_eq!(plain(work), (0, String::new(), String::new()), "{work:?}");
    }
    for answer in [&["info", text(&map)][..], &["snapshots", text(&map)], &["verify", text(&map)]] {
        let (code, out, text_out) = plain(answer);
        assert!(code == 0 && !out.is_empty() && text_out.is_empty(), "{answer:?}: {out}{text_out}");
    }

    let export = ["export", text(&map), "-o", "-", "--format", "csv"];
    let [(_, file, text_out), (_, same, nothing)] = [loud, quiet].map(|case| run(&export, case));
    assert!(text_out.contains("voxels in standard output") && nothing.is_empty(), "{text_out}{nothing}");
    assert!(!file.is_empty() && file == same);

    for case in [loud, quiet] {
        let (code, out, text_out) = run(&["info", "/no/map"], case);
        assert_eq!((code, out.as_str()), (1, ""));
        assert!(text_out.starts_with("voxtile: /no/map: no map here"), "{text_out}");
    }
}

#[test]
fn quiet_and_verbose_exclude_each_other() {
    let (code, out, text_out) = run(&["info", "/no/map", "-q", "-v"], &CASES[0]);
    assert_eq!((code, out.as_str()), (2, ""));
    assert!(text_out.contains("cannot be used with"), "{text_out}");
}

#[test]
fn the_log_and_errors_can_be_json() {
    let folder = TempDir::new().unwrap();
    let (source, map) = (scans(&folder), folder.path().join("map"));
    let case = case(&["-v", "--log-format", "json"], None, [true, false]);
    let (_, log) = build(&source, &map, &case);
    let records = |log: &str| -> Vec<serde_json::Value> {
        log.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
    };
    let found = records(&log);
    let is_flush = |record: &serde_json::Value| {
        record["level"] == "info" && record["message"].as_str().unwrap().contains("flush 1")
    };
    assert!(found.iter().any(is_flush), "{log}");
    let (code, _, log) = run(&["view", "no_such_map", "--no-browser"], &case);
    let found = records(&log);
    let [error] = &*found else { panic!("{log}") };
    assert_eq!((code, &error["level"], &error["target"]), (1, &"error".into(), &"voxtile".into()));
    assert!(error["message"].as_str().unwrap().contains("no_such_map"), "{log}");
    assert!(error["time"].as_str().unwrap().ends_with('Z'), "{log}");
}
