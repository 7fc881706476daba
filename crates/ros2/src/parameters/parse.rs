use super::known::Known;
use super::parameter_file;
use super::ros_args::RosArgs;
use super::value::Value;
use crate::args::Args;
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory as _, Error, FromArgMatches as _};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::PathBuf;

/// Value of a parameter and its source for messages.
struct Given {
    value: Value,
    source: String,
}

/// Parses the command line with the parameters on it and the files that it names. Options override parameters, which
/// override files.
///
/// # Errors
///
/// Invalid options, unreadable files, and unknown or invalid parameters.
pub fn parse(arguments: &[OsString]) -> Result<Args, Error> {
    let RosArgs { arguments, parameters } = RosArgs::of(arguments).map_err(wrong)?;
    let given = given_by(&arguments, parameters)?;
    let has_output = given.contains_key("output");
    // The output is optional here if a file sets it.
    let command = Args::command().mut_arg("output", |output| match has_output {
        true => output.required(false).default_value("map"),
        false => output,
    });
    let matches = command.try_get_matches_from(&arguments)?;
    let mut args = Args::from_arg_matches(&matches)?;
    for (field, Given { value, source }) in &given {
        if matches.value_source(field) != Some(ValueSource::CommandLine) {
            args = with(&args, field, value).map_err(|why| wrong(format!("{source}: {why}")))?;
        }
    }
    if args.zenoh_config.is_some() && (args.network || given.contains_key("zenoh_router")) {
        return Err(wrong("zenoh_config cannot be combined with zenoh_router or network".to_owned()));
    }
    Ok(args)
}

/// Returns the fields that files and parameters set. If several set a field, the last value counts.
fn given_by(arguments: &[OsString], parameters: Vec<[String; 2]>) -> Result<BTreeMap<String, Given>, Error> {
    let mut given = BTreeMap::new();
    // If this parse fails, the later complete parse of the command line reports the error.
    let Ok(named) = Args::command().ignore_errors(true).try_get_matches_from(arguments) else {
        return Ok(given);
    };
    let files = named.try_get_many::<PathBuf>("params_file").ok().flatten();
    for file in files.into_iter().flatten() {
        let parameters = parameter_file::read(file, &node_of(&named));
        let parameters = parameters.map_err(|error| wrong(format!("--params-file: {error:#}")))?;
        for (name, value) in parameters {
            put(&mut given, &file.display().to_string(), &name, value)?;
        }
    }
    for [name, text] in parameters {
        let value = serde_saphyr::from_str::<Value>(&text);
        let value = value.map_err(|error| wrong(format!("--param {name}: invalid YAML {text}: {error}")))?;
        put(&mut given, "--param", &name, value)?;
    }
    Ok(given)
}

fn node_of(named: &ArgMatches) -> String {
    let text = |id| named.try_get_one::<String>(id).ok().flatten().cloned().unwrap_or_default();
    format!("{}/{}", text("namespace"), text("node_name"))
}

fn put(given: &mut BTreeMap<String, Given>, source: &str, name: &str, value: Value) -> Result<(), Error> {
    let source = format!("{source}: parameter {name}");
    match Known::of(name) {
        Known::WithoutEffect => log::warn!("{source} has no effect"),
        Known::Unknown => {
            let names = Known::names().join(", ");
            return Err(wrong(format!("{source} is unknown; known parameters: {names}")));
        }
        // A negative value of octomap_server means no limit.
        Known::Field(field) if field == "max_range" && is_negative(&value) => {
            given.insert(field, Given { value: Value::Nothing(()), source });
        }
        Known::Field(field) => {
            given.insert(field, Given { value, source });
        }
    }
    Ok(())
}

/// Returns the options with one field replaced.
fn with(args: &Args, field: &str, value: &Value) -> Result<Args, String> {
    // All numbers are finite: the YAML reader rejects others.
    let changed = || -> serde_json::Result<Args> {
        let mut fields = serde_json::to_value(args)?;
        fields[field] = serde_json::to_value(value)?;
        serde_json::from_value(fields)
    };
    changed().map_err(|error| error.to_string())
}

fn wrong(what: String) -> Error {
    Args::command().error(ErrorKind::ValueValidation, what)
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
    fn the_command_line_overrides_the_file() {
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
    fn launch_parameters_override_files_and_options_override_both() {
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
            let error = parsed(FILE, &["--ros-args", "-p", wrong]).unwrap_err();
            assert!(error.contains("--param") && error.contains(wrong.split(':').next().unwrap()), "{error}");
        }
    }

    #[test]
    fn later_values_can_switch_options_off() {
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
    fn errors_name_the_source_of_a_parameter() {
        let with =
            |line: &str| parsed(&format!("/**: {{ros__parameters: {{{line}}}}}"), &["-o", "m"]).unwrap_err();
        assert!(
            with("resolutoin: 0.1").contains("p.yaml: parameter resolutoin is unknown; known parameters:")
        );
        assert!(
            with("resolution: fine").contains("p.yaml: parameter resolution: invalid type: string \"fine\"")
        );
        assert!(with("network: 7").contains("parameter network: invalid type: integer"));
        assert!(with("resolution: []").contains("parameter resolution: invalid type: sequence"));
        for name in ["transform_wait", "pose_tolerance", "path_tolerance"] {
            for (value, why) in [("-1", "give "), ("-1e-9", "give "), ("1e20", "give "), ("'nan'", "invalid")]
            {
                let error = with(&format!("{name}: {value}"));
                assert!(error.contains(&format!("p.yaml: parameter {name}: {why}")), "{error}");
                assert!(why != "give " || error.contains("from 0 to "), "{error}");
            }
        }
        assert!(with("domain_id: 233").contains("give a domain from 0 to 232"));
        assert!(with("cloud: []").contains("give at least one"));
        assert!(with("zenoh_config: a, network: true").contains("cannot be combined with zenoh_router"));
        assert!(parsed("/**: 7", &["-o", "m"]).unwrap_err().contains("p.yaml"));
        assert!(parsed("{}", &[]).unwrap_err().contains("--output"));
    }
}
