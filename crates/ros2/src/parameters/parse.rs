use super::known::Known;
use super::parameter_file;
use super::ros_args::RosArgs;
use super::value::Value;
use crate::args::Args;
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory as _, Error, Parser as _};
use std::ffi::OsString;
use std::path::PathBuf;

/// The options of a command line, of the parameters on it, and of the files that it names; options win over parameters,
/// and these over files.
///
/// # Errors
///
/// Wrong options; files that cannot be read; parameters that are not known, or have a wrong value.
pub fn parse(arguments: &[OsString]) -> Result<Args, Error> {
    let RosArgs { arguments, parameters } = RosArgs::of(arguments).map_err(wrong)?;
    let arguments = arguments.as_slice();
    // Only what is there is looked at: what a file may give can still be missing.
    let given = Args::command().ignore_errors(true).try_get_matches_from(arguments);
    let Ok(given) = given else { return Args::try_parse_from(arguments) };
    let files = given.try_get_many::<PathBuf>("params_file").ok().flatten();
    let files: Vec<PathBuf> = files.into_iter().flatten().cloned().collect();
    let text = |id| given.try_get_one::<String>(id).ok().flatten().cloned().unwrap_or_default();
    let node = format!("{}/{}", text("namespace"), text("node_name"));
    let mut from_files: Vec<(String, Vec<OsString>)> = Vec::new();
    // A later one wins.
    let mut put = |found: Vec<(String, Vec<OsString>)>| {
        for (long, options) in found {
            from_files.retain(|(earlier, _)| *earlier != long);
            from_files.push((long, options));
        }
    };
    for file in &files {
        let parameters = parameter_file::read(file, &node);
        let parameters = parameters.map_err(|error| wrong(format!("--params-file: {error:#}")))?;
        put(options_of(&file.display().to_string(), parameters, &given)?);
    }
    for [name, text] in parameters {
        let value = serde_saphyr::from_str::<Value>(&text);
        let value = value.map_err(|error| wrong(format!("--param {name}: {text} is no YAML: {error}")))?;
        put(options_of("--param", [(name, value)], &given)?);
    }
    let mut all: Vec<OsString> = arguments.iter().take(1).cloned().collect();
    all.extend(from_files.into_iter().flat_map(|(_, options)| options));
    all.extend(arguments.iter().skip(1).cloned());
    Args::try_parse_from(all)
}

fn wrong(what: String) -> Error {
    Args::command().error(ErrorKind::ValueValidation, what)
}

/// The options that parameters mean, but for those that are given anyhow.
fn options_of(
    source: &str,
    parameters: impl IntoIterator<Item = (String, Value)>,
    given: &ArgMatches,
) -> Result<Vec<(String, Vec<OsString>)>, Error> {
    let mut found = Vec::new();
    for (name, value) in parameters {
        let place = format!("{source}: parameter {name}");
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
                // Nothing, in the place of what an earlier file says.
                Value::Bool(false) => (long, Vec::new()),
                _ => return Err(no_value()),
            },
            // octomap_server's word for no limit.
            Known::Option(long) if long == "max-range" && is_negative(&value) => (long, Vec::new()),
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
    fn parameters_of_launch_files_win_over_files_and_options_over_them() {
        let launch = ["--ros-args", "-p", "resolution:=0.3", "-p", "hit:=0.9", "-p", "cloud:=[/c, d]"];
        let args = parsed(FILE, &launch).unwrap();
        assert_eq!((args.resolution, args.hit, args.miss), (0.3, Some(0.9), None));
        assert_eq!(args.cloud, ["/c", "d"]);
        let args = parsed(FILE, &[&["--resolution", "0.4"], &launch[..]].concat()).unwrap();
        assert_eq!((args.resolution, args.hit), (0.4, Some(0.9)));
        let named = "/robot/mapper: {ros__parameters: {output: m, resolution: 0.7}}";
        let args = parsed(named, &["--ros-args", "-r", "__ns:=/robot", "-r", "__node:=mapper"]).unwrap();
        assert_eq!((args.resolution, &*args.namespace, &*args.node_name), (0.7, "/robot", "mapper"));
        for wrong in ["resolutoin:=1", "resolution:=fine", "resolution:={", "network:=7"] {
            let told = parsed(FILE, &["--ros-args", "-p", wrong]).unwrap_err();
            assert!(told.contains("--param") && told.contains(wrong.split(':').next().unwrap()), "{told}");
        }
    }

    #[test]
    fn what_is_switched_off_later_is_off() {
        let on = "/**: {ros__parameters: {output: m, network: true, keep_scans: true, max_range: 9.0}}";
        let args = parsed(on, &[]).unwrap();
        assert_eq!((args.network, args.keep_scans, args.max_range), (true, true, Some(9.0)));
        let off = ["--ros-args", "-p", "network:=false", "-p", "keep_scans:=false", "-p", "max_range:=-1"];
        let args = parsed(on, &off).unwrap();
        assert_eq!((args.network, args.keep_scans, args.max_range), (false, false, None));
        let args = parsed(on, &[&["--network", "--max-range", "7"], &off[..]].concat()).unwrap();
        assert_eq!((args.network, args.keep_scans, args.max_range), (true, false, Some(7.0)));
    }

    #[test]
    fn what_is_not_known_or_wrong_is_told_with_its_place() {
        let with =
            |line: &str| parsed(&format!("/**: {{ros__parameters: {{{line}}}}}"), &["-o", "m"]).unwrap_err();
        assert!(with("resolutoin: 0.1").contains("p.yaml: parameter resolutoin is not known; known are"));
        assert!(with("resolution: fine").contains("p.yaml: parameter resolution: invalid value 'fine'"));
        assert!(with("network: 7").contains("parameter network has no value that it can have"));
        assert!(with("resolution: []").contains("parameter resolution has no value"));
        for name in ["transform_wait", "pose_tolerance", "path_tolerance"] {
            for value in ["-1", "-1e-9", "'nan'", "'inf'", "1e20"] {
                let told = with(&format!("{name}: {value}"));
                let option = name.replace('_', "-");
                let place = format!("p.yaml: parameter {name}: invalid value");
                assert!(told.contains(&place) && told.contains(&option), "{told}");
                assert!(told.contains("give ") && told.contains("from 0 to "), "{told}");
            }
        }
        assert!(parsed("/**: 7", &["-o", "m"]).unwrap_err().contains("p.yaml"));
        assert!(parsed("{}", &[]).unwrap_err().contains("--output"));
    }
}
