use crate::args::Args;
use clap::{ArgAction, CommandFactory as _};

/// What a parameter's name means here.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Known {
    /// An option with a value, or with several.
    Option(String),
    /// An option without a value: true or false.
    Switch(String),
    /// One of octomap_server, or of ROS, that changes nothing here.
    WithoutEffect,
    Unknown,
}

/// Names of octomap_server for options that have others.
const ALIASES: [(&str, &str); 6] = [
    ("sensor_model.max_range", "max-range"),
    ("sensor_model.min_range", "min-range"),
    ("sensor_model.hit", "hit"),
    ("sensor_model.miss", "miss"),
    ("sensor_model.min", "clamp-min"),
    ("sensor_model.max", "clamp-max"),
];

/// What is drawn, how topics are latched and compressed, and whose clock counts: the stamps of messages do here.
const WITHOUT_EFFECT: [&str; 8] = [
    "base_frame_id",
    "color",
    "color_free",
    "colored_map",
    "compress_map",
    "latch",
    "use_height_map",
    "use_sim_time",
];

/// Options that are for a command line alone.
const NOT_IN_FILES: [&str; 6] = ["params-file", "node-name", "namespace", "remap", "help", "version"];

impl Known {
    pub fn of(name: &str) -> Self {
        let group = name.split('.').next().unwrap_or_default();
        if WITHOUT_EFFECT.contains(&group) || group == "qos_overrides" {
            return Self::WithoutEffect;
        }
        let long = ALIASES.iter().find(|(alias, _)| *alias == name);
        let long = long.map_or_else(|| name.replace('_', "-"), |(_, long)| (*long).to_owned());
        let command = Args::command();
        let found = command.get_arguments().find(|arg| arg.get_long() == Some(&long));
        match found.map(|arg| arg.get_action()) {
            Some(_) if NOT_IN_FILES.contains(&long.as_str()) => Self::Unknown,
            Some(ArgAction::SetTrue) => Self::Switch(long),
            Some(_) => Self::Option(long),
            None => Self::Unknown,
        }
    }

    /// All names that mean an option.
    pub fn names() -> Vec<String> {
        let command = Args::command();
        let longs = command.get_arguments().filter_map(|arg| arg.get_long());
        let longs = longs.filter(|long| !NOT_IN_FILES.contains(long)).map(|long| long.replace('-', "_"));
        longs.chain(ALIASES.map(|(alias, _)| alias.to_owned())).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_mean_options() {
        let option = |long: &str| Known::Option(long.to_owned());
        assert_eq!(Known::of("resolution"), option("resolution"));
        assert_eq!(Known::of("occupancy_min_z"), option("occupancy-min-z"));
        assert_eq!(Known::of("sensor_model.max"), option("clamp-max"));
        assert_eq!(Known::of("network"), Known::Switch("network".to_owned()));
        assert_eq!(Known::of("color.r"), Known::WithoutEffect);
        for unknown in ["", "help", "params_file", "filter_ground_plane", "sensor_model.hits"] {
            assert_eq!(Known::of(unknown), Known::Unknown, "{unknown}");
        }
        for name in Known::names() {
            assert!(!matches!(Known::of(&name), Known::Unknown | Known::WithoutEffect), "{name}");
        }
    }
}
