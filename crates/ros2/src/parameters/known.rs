use crate::args::Args;
use clap::CommandFactory as _;

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Known {
    /// Field of [`Args`].
    Field(String),
    /// Parameter of octomap_server or ROS that has no effect in this node.
    WithoutEffect,
    Unknown,
}

/// Parameter names of octomap_server and the corresponding fields.
const ALIASES: [(&str, &str); 6] = [
    ("sensor_model.max_range", "max_range"),
    ("sensor_model.min_range", "min_range"),
    ("sensor_model.hit", "hit"),
    ("sensor_model.miss", "miss"),
    ("sensor_model.min", "clamp_min"),
    ("sensor_model.max", "clamp_max"),
];

/// Parameters for colors, latching, compression and clocks. This node always uses the stamps of messages.
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

/// Fields that only the command line may set.
const NOT_IN_FILES: [&str; 6] = ["params_file", "node_name", "namespace", "remap", "help", "version"];

impl Known {
    pub fn of(name: &str) -> Self {
        let group = name.split('.').next().unwrap_or_default();
        if WITHOUT_EFFECT.contains(&group) || group == "qos_overrides" {
            return Self::WithoutEffect;
        }
        let alias = ALIASES.iter().find(|(alias, _)| *alias == name);
        let field = alias.map_or(name, |(_, field)| field);
        let is_known = fields().iter().any(|known| known == field);
        if is_known { Self::Field(field.to_owned()) } else { Self::Unknown }
    }

    /// Returns all names that refer to a field.
    pub fn names() -> Vec<String> {
        fields().into_iter().chain(ALIASES.map(|(alias, _)| alias.to_owned())).collect()
    }
}

fn fields() -> Vec<String> {
    let command = Args::command();
    let fields = command.get_arguments().map(|arg| arg.get_id().to_string());
    fields.filter(|field| !NOT_IN_FILES.contains(&field.as_str())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_refer_to_fields() {
        let field = |name: &str| Known::Field(name.to_owned());
        assert_eq!(Known::of("resolution"), field("resolution"));
        assert_eq!(Known::of("occupancy_min_z"), field("occupancy_min_z"));
        assert_eq!(Known::of("sensor_model.max"), field("clamp_max"));
        assert_eq!(Known::of("network"), field("network"));
        assert_eq!(Known::of("color.r"), Known::WithoutEffect);
        for unknown in ["", "help", "params_file", "filter_ground_plane", "sensor_model.hits"] {
            assert_eq!(Known::of(unknown), Known::Unknown, "{unknown}");
        }
        for name in Known::names() {
            assert!(!matches!(Known::of(&name), Known::Unknown | Known::WithoutEffect), "{name}");
        }
    }
}
