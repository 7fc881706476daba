use super::known::Known;
use super::parameter_file;
use super::value::Value;
use crate::args::Args;
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory as _, Error, Parser as _};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The options of a command line, and of the files that it names; what stands on the command line wins.
///
/// # Errors
///
/// Wrong options; files that cannot be read; parameters that are not known, or have a wrong value.
pub fn parse(arguments: &[OsString]) -> Result<Args, Error> {
    // Only what is there is looked at: what a file may give can still be missing.
    let given = Args::command().ignore_errors(true).try_get_matches_from(arguments);
    let Ok(given) = given else { return Args::try_parse_from(arguments) };
    let files = given.try_get_many::<PathBuf>("params_file").ok().flatten();
    let files: Vec<PathBuf> = files.into_iter().flatten().cloned().collect();
    let node_name = given.try_get_one::<String>("node_name").ok().flatten().cloned().unwrap_or_default();
    let mut from_files: Vec<(String, Vec<OsString>)> = Vec::new();
    for file in &files {
        for (long, options) in options_of(file, &node_name, &given)? {
            // A later file wins.
            from_files.retain(|(earlier, _)| *earlier != long);
            from_files.push((long, options));
        }
    }
    let mut all: Vec<OsString> = arguments.iter().take(1).cloned().collect();
    all.extend(from_files.into_iter().flat_map(|(_, options)| options));
    all.extend(arguments.iter().skip(1).cloned());
    Args::try_parse_from(all)
}

/// The options of a file, but for those that are given anyhow.
fn options_of(
    file: &Path,
    node_name: &str,
    given: &ArgMatches,
) -> Result<Vec<(String, Vec<OsString>)>, Error> {
    let wrong = |what: String| Args::command().error(ErrorKind::ValueValidation, what);
    let parameters =
        parameter_file::read(file, node_name).map_err(|error| wrong(format!("--params-file: {error:#}")))?;
    let mut found = Vec::new();
    for (name, value) in parameters {
        let place = format!("{}: parameter {name}", file.display());
        let no_value = || wrong(format!("{place} has no value that it can have: {value:?}"));
        let (long, options) = match Known::of(&name) {
            Known::WithoutEffect => {
                log::warn!("{place} has no effect here");
                continue;
            }
            Known::Unknown => {
                let names = Known::names().join(", ");
                return Err(wrong(format!("{place} is not known; known are {names}")));
            }
            Known::Switch(long) => match value {
                Value::Bool(true) => (long.clone(), vec![format!("--{long}").into()]),
                Value::Bool(false) => continue,
                _ => return Err(no_value()),
            },
            // octomap_server's word for no limit.
            Known::Option(long) if long == "max-range" && is_negative(&value) => continue,
            Known::Option(long) => {
                let values = match &value {
                    Value::List(values) => values.iter().map(Value::text).collect(),
                    value => value.text().map(|text| vec![text]),
                };
                let values = values.filter(|values| !values.is_empty()).ok_or_else(no_value)?;
                let option = |text: &String| OsString::from(format!("--{long}={text}"));
                (long.clone(), values.iter().map(option).collect())
            }
        };
        // By itself, so that what is wrong is told with its file.
        let mut alone: Vec<OsString> = vec!["voxtile-ros2".into()];
        if long != "output" {
            alone.push("--output=map".into());
        }
        alone.extend(options.iter().cloned());
        if let Err(error) = Args::try_parse_from(alone) {
            let error = error.to_string();
            let why = error.lines().next().unwrap_or_default().trim_start_matches("error: ");
            return Err(wrong(format!("{place}: {why}")));
        }
        let id = long.replace('-', "_");
        if given.try_get_raw(&id).is_err() || given.value_source(&id) != Some(ValueSource::CommandLine) {
            found.push((long, options));
        }
    }
    Ok(found)
}

fn is_negative(value: &Value) -> bool {
    matches!(value, Value::Whole(..0)) || matches!(value, Value::Number(number) if *number < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(file: &str, options: &[&str]) -> Result<Args, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.yaml");
        std::fs::write(&path, file).unwrap();
        let mut arguments: Vec<OsString> = vec!["voxtile-ros2".into(), "--params-file".into(), path.into()];
        arguments.extend(options.iter().map(OsString::from));
        parse(&arguments).map_err(|error| error.to_string())
    }

    const FILE: &str = "\
/**:
  ros__parameters:
    output: /maps/a
    resolution: 0.2
    cloud: [/a, /b]
    sensor_model: {max_range: -1.0, hit: 0.8}
    occupancy_min_z: -0.5
    network: true
    latch: true
";

    #[test]
    fn the_file_gives_options_and_the_command_line_wins() {
        let args = parsed(FILE, &[]).unwrap();
        assert_eq!((args.resolution, args.max_range, args.hit), (0.2, None, Some(0.8)));
        assert_eq!(
            (args.cloud, args.network, args.occupancy_min_z),
            (vec!["/a".into(), "/b".into()], true, Some(-0.5))
        );
        let args = parsed(FILE, &["--resolution", "0.4", "--cloud", "/c", "-o", "/maps/b"]).unwrap();
        assert_eq!((args.resolution, args.cloud), (0.4, vec!["/c".to_owned()]));
        assert_eq!(args.output, PathBuf::from("/maps/b"));
    }

    #[test]
    fn what_is_not_known_or_wrong_is_told_with_its_place() {
        let with =
            |line: &str| parsed(&format!("/**: {{ros__parameters: {{{line}}}}}"), &["-o", "m"]).unwrap_err();
        assert!(with("resolutoin: 0.1").contains("p.yaml: parameter resolutoin is not known; known are"));
        assert!(with("resolution: fine").contains("p.yaml: parameter resolution: invalid value 'fine'"));
        assert!(with("network: 7").contains("parameter network has no value that it can have"));
        assert!(with("resolution: []").contains("parameter resolution has no value"));
        assert!(parsed("/**: 7", &["-o", "m"]).unwrap_err().contains("p.yaml"));
        assert!(parsed("{}", &[]).unwrap_err().contains("--output"));
    }
}
