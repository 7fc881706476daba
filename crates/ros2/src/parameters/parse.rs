use super::known;
use super::octomap_server::{Effect, effect_of};
use super::parameter_file::{self, NodeName};
use super::remark::Remark;
use super::ros_args::RosArgs;
use super::value::Value;
use crate::args::{Args, DEFAULT_NODE_NAME};
use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, CommandFactory as _, Error, FromArgMatches as _};
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Options of the node, and remarks about them for the log.
#[derive(Clone, Debug)]
pub struct Parsed {
    pub args: Args,
    pub remarks: Vec<Remark>,
}

/// Value of a parameter and its source for messages.
struct Given {
    value: Value,
    source: String,
}

/// Fields that parameters set. If several set a field, the last value counts.
#[derive(Default)]
struct AllGiven {
    fields: BTreeMap<String, Given>,
    /// Names of parameters without effect.
    without_effect: Vec<String>,
    remarks: Vec<Remark>,
}

/// Parses the command line with the parameters on it and the files that it names. Options override parameters, which
/// override files.
///
/// # Errors
///
/// Invalid options, unreadable files, and unknown or invalid parameters.
pub fn parse(arguments: &[OsString]) -> Result<Parsed, Error> {
    let RosArgs { arguments, parameters, remarks } = RosArgs::of(arguments).map_err(wrong)?;
    let mut given = AllGiven { remarks, ..AllGiven::default() };
    given.read(&arguments, parameters)?;
    let has_output = given.fields.contains_key("output");
    // The output is optional here if a file sets it.
    let command = Args::command().mut_arg("output", |output| match has_output {
        true => output.required(false).default_value("map"),
        false => output,
    });
    let matches = command.try_get_matches_from(&arguments)?;
    let mut args = Args::from_arg_matches(&matches)?;
    for (field, Given { value, source }) in &given.fields {
        if matches.value_source(field) != Some(ValueSource::CommandLine) {
            args = with(&args, field, value).map_err(|why| wrong(format!("{source}: {why}")))?;
        }
    }
    if args.zenoh_config.is_some() && (args.network || given.fields.contains_key("zenoh_router")) {
        return Err(wrong("zenoh_config cannot be combined with zenoh_router or network".to_owned()));
    }
    Ok(Parsed { args, remarks: given.remarks })
}

impl AllGiven {
    /// Reads the files that the arguments name, then the parameters of the command line.
    fn read(&mut self, arguments: &[OsString], parameters: Vec<[String; 2]>) -> Result<(), Error> {
        // If this parse fails, the later complete parse of the command line reports the error.
        let Ok(named) = Args::command().ignore_errors(true).try_get_matches_from(arguments) else {
            return Ok(());
        };
        let files = named.try_get_many::<PathBuf>("params_file").ok().flatten();
        for file in files.into_iter().flatten() {
            let parameters = parameter_file::read(file, &node_of(&named), &mut self.remarks);
            let parameters = parameters.map_err(|error| wrong(format!("--params-file: {error:#}")))?;
            for (name, placed) in parameters {
                self.put(&format!("{}:{}", file.display(), placed.line), &name, placed.value)?;
            }
            self.note_without_effect(file);
        }
        for [name, text] in parameters {
            let value = serde_saphyr::from_str::<Value>(&text);
            let value = value.map_err(|error| {
                wrong(format!("--param {name}: invalid YAML {text}: {}", error.without_snippet()))
            })?;
            self.put("--param", &name, value)?;
        }
        self.note_without_effect(Path::new("--param"));
        Ok(())
    }

    fn put(&mut self, source: &str, name: &str, value: Value) -> Result<(), Error> {
        let source = format!("{source}: parameter {name}");
        let Some(field) = known::field_of(name) else {
            match effect_of(name, &value) {
                Some(Effect::None) => self.without_effect.push(name.to_owned()),
                Some(Effect::Topics(what)) => {
                    self.remarks.push(Remark::warning(format!("{source} has no effect: {what}")));
                }
                None => {
                    let names = known::names().join(", ");
                    return Err(wrong(format!("{source} is unknown; known parameters: {names}")));
                }
            }
            return Ok(());
        };
        // Values of octomap_server that mean none.
        let is_none = match (&*field, &value) {
            ("max_range", value) => is_negative(value),
            ("octomap_path", Value::Text(path)) => path.is_empty(),
            _ => false,
        };
        let value = match (name, value) {
            _ if is_none => Value::Nothing,
            ("colored_map", Value::Bool(true)) => Value::Text("colour".to_owned()),
            ("colored_map", Value::Bool(false)) => Value::Nothing,
            (_, value) => value,
        };
        self.fields.insert(field, Given { value, source });
        Ok(())
    }

    fn note_without_effect(&mut self, source: &Path) {
        let names = std::mem::take(&mut self.without_effect);
        if !names.is_empty() {
            let text = format!("{}: without effect in this node: {}", source.display(), names.join(", "));
            self.remarks.push(Remark::info(text));
        }
    }
}

fn node_of(named: &ArgMatches) -> NodeName {
    let text = |id| named.try_get_one::<String>(id).ok().flatten().cloned().unwrap_or_default();
    let (namespace, name) = (text("namespace"), text("node_name"));
    let full = format!("/{}/{name}", namespace.trim_matches('/')).replace("//", "/");
    NodeName { full, is_default: name == DEFAULT_NODE_NAME }
}

/// Returns the options with one field replaced.
fn with(args: &Args, field: &str, value: &Value) -> Result<Args, String> {
    // All numbers are finite: the YAML reader rejects others.
    let changed = || -> serde_json::Result<Args> {
        let mut fields = serde_json::to_value(args)?;
        fields[field] = serde_json::to_value(value)?;
        serde_json::from_value(fields)
    };
    let mut changed = changed().map_err(|error| error.to_string())?;
    // JSON has no paths that are not valid Unicode.
    changed.params_file.clone_from(&args.params_file);
    if field != "output" {
        changed.output.clone_from(&args.output);
    }
    for (name, to, from) in [
        ("octomap_path", &mut changed.octomap_path, &args.octomap_path),
        ("zenoh_config", &mut changed.zenoh_config, &args.zenoh_config),
    ] {
        if field != name {
            to.clone_from(from);
        }
    }
    Ok(changed)
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
        parse(&arguments).map(|parsed| parsed.args).map_err(|error| error.to_string())
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
            with("resolutoin: 0.1").contains("p.yaml:1: parameter resolutoin is unknown; known parameters:")
        );
        assert!(
            with("resolution: fine")
                .contains("p.yaml:1: parameter resolution: invalid type: string \"fine\"")
        );
        assert!(with("network: 7").contains("parameter network: invalid type: integer"));
        assert!(with("resolution: []").contains("parameter resolution: invalid type: sequence"));
        for name in ["transform_wait", "pose_tolerance", "path_tolerance"] {
            for (value, why) in [("-1", "give "), ("-1e-9", "give "), ("1e20", "give "), ("'nan'", "invalid")]
            {
                let error = with(&format!("{name}: {value}"));
                assert!(error.contains(&format!("p.yaml:1: parameter {name}: {why}")), "{error}");
                assert!(why != "give " || error.contains("from 0 to "), "{error}");
            }
        }
        assert!(with("domain_id: 233").contains("give a domain from 0 to 232"));
        assert!(with("cloud: []").contains("give at least one"));
        assert!(with("zenoh_config: a, network: true").contains("cannot be combined with zenoh_router"));
        assert!(parsed("/**: 7", &["-o", "m"]).unwrap_err().contains("p.yaml"));
        assert!(parsed("{}", &[]).unwrap_err().contains("--output"));
    }

    /// Parameters of octomap_server as `ros2 param dump` writes them, with other values than the defaults where both
    /// programs have the parameter.
    const OCTOMAP_SERVER: &str = "\
/octomap_server:
  ros__parameters:
    base_frame_id: base_footprint
    color: {a: 1.0, b: 1.0, g: 0.0, r: 0.0}
    color_factor: 0.8
    color_free: {a: 1.0, b: 0.0, g: 1.0, r: 0.0}
    colored_map: false
    compress_map: true
    filter_ground_plane: false
    filter_speckles: false
    frame_id: odom
    ground_filter: {angle: 0.15, distance: 0.04, plane_distance: 0.07}
    incremental_2D_projection: false
    latch: true
    max_depth: 16
    min_x_size: 0.0
    min_y_size: 0.0
    occupancy_max_z: 100.0
    occupancy_min_z: -100.0
    octomap_path: ''
    point_cloud_max_x: 1.7976931348623157e+308
    point_cloud_max_y: 1.7976931348623157e+308
    point_cloud_max_z: 2.5
    point_cloud_min_x: -1.7976931348623157e+308
    point_cloud_min_y: -1.7976931348623157e+308
    point_cloud_min_z: -0.5
    publish_free_space: false
    qos_overrides:
      /parameter_events:
        publisher: {depth: 1000, durability: volatile, history: keep_last, reliability: reliable}
    resolution: 0.1
    sensor_model: {hit: 0.8, max: 0.97, max_range: -1.0, min: 0.12, miss: 0.4}
    start_type_description_service: true
    use_height_map: true
    use_sim_time: false
";

    #[test]
    fn a_file_of_octomap_server_is_read_unchanged() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("p.yaml");
        std::fs::write(&path, OCTOMAP_SERVER).unwrap();
        let arguments = ["voxtile-ros2".into(), "-o".into(), "m".into(), "--params-file".into(), path.into()];
        let Parsed { args, remarks } = parse(&arguments).unwrap();
        assert_eq!((&*args.frame_id, args.resolution, args.hit), ("odom", 0.1, Some(0.8)));
        assert_eq!((args.max_range, args.octomap_path.clone()), (None, None));
        let limits = args.point_limits().unwrap().0;
        assert_eq!((limits[0], limits[2]), ([-f64::MAX, f64::MAX], [-0.5, 2.5]));
        let of_level = |level| -> Vec<&str> {
            remarks.iter().filter(|remark| remark.level == level).map(|remark| &*remark.text).collect()
        };
        // One remark lists all parameters without effect, one names the section.
        let [section, effects] = *of_level(log::Level::Info) else { panic!("{remarks:?}") };
        assert!(section.contains("/octomap_server is used for /voxtile_ros2"), "{section}");
        assert!(effects.contains("color.a, ") && !effects.contains("ground_filter"), "{effects}");
        let warnings = of_level(log::Level::Warn);
        assert!(
            warnings.len() == 4 && warnings.iter().all(|text| text.contains("qos_overrides")),
            "{warnings:?}"
        );
    }

    #[test]
    fn parameters_that_change_the_map_have_an_effect_or_an_error_with_their_line() {
        let changed = |from: &str, to: &str| parsed(&OCTOMAP_SERVER.replace(from, to), &["-o", "m"]);
        let filter = changed("filter_ground_plane: false", "filter_ground_plane: true").unwrap();
        assert_eq!(filter.base_frame_id, "base_footprint");
        let filter = filter.ground_filter().unwrap().unwrap();
        assert_eq!((filter.distance_m, filter.angle_rad, filter.plane_distance_m), (0.04, 0.15, 0.07));
        let error = changed("filter_ground_plane: false", "filter_ground_plane: some").unwrap_err();
        assert!(error.contains("p.yaml:9: parameter filter_ground_plane: invalid type"), "{error}");
        let coloured = changed("colored_map: false", "colored_map: true").unwrap();
        assert_eq!(coloured.layers, Some("colour".parse().unwrap()));
        assert_eq!(changed("colored_map: false", "colored_map: false").unwrap().layers, None);
        let error = changed("hit: 0.8", "hit: high").unwrap_err();
        assert!(error.contains("p.yaml:32: parameter sensor_model.hit: invalid type: string"), "{error}");
        let error = changed("latch:", "latched:").unwrap_err();
        assert!(error.contains("p.yaml:14: parameter latched is unknown"), "{error}");
        assert!(changed("filter_speckles: false", "filter_speckles: true").is_ok());
    }

    #[test]
    #[cfg(unix)]
    fn paths_need_not_be_valid_unicode() {
        use std::os::unix::ffi::OsStringExt as _;
        let (folder, name) = (tempfile::tempdir().unwrap(), OsString::from_vec(b"m\xff".to_vec()));
        let file = folder.path().join(&name);
        std::fs::write(&file, "/**: {ros__parameters: {resolution: 0.2, hit: 0.8}}").unwrap();
        let options = ["voxtile-ros2".into(), "-o".into(), name.clone(), "--params-file".into(), file.into()];
        let args = parse(&options).unwrap().args;
        assert_eq!((args.output.as_os_str(), args.resolution), (&*name, 0.2));
    }
}
