use crate::args::Args;
use clap::CommandFactory as _;

/// Parameter names of octomap_server and the corresponding fields.
const ALIASES: [(&str, &str); 10] = [
    ("sensor_model.max_range", "max_range"),
    ("sensor_model.min_range", "min_range"),
    ("sensor_model.hit", "hit"),
    ("sensor_model.miss", "miss"),
    ("sensor_model.min", "clamp_min"),
    ("sensor_model.max", "clamp_max"),
    ("ground_filter.distance", "ground_filter_distance"),
    ("ground_filter.angle", "ground_filter_angle"),
    ("ground_filter.plane_distance", "ground_filter_plane_distance"),
    // `true` is the layer colour, see `parse`.
    ("colored_map", "layers"),
];

/// Fields that only the command line may set.
const NOT_IN_FILES: [&str; 6] = ["params_file", "node_name", "namespace", "remap", "help", "version"];

/// Returns the field of [`Args`] that a parameter sets.
pub fn field_of(name: &str) -> Option<String> {
    let alias = ALIASES.iter().find(|(alias, _)| *alias == name);
    let field = alias.map_or(name, |(_, field)| field);
    fields().into_iter().find(|known| known == field)
}

/// Returns all names that refer to a field.
pub fn names() -> Vec<String> {
    fields().into_iter().chain(ALIASES.map(|(alias, _)| alias.to_owned())).collect()
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
        for (name, field) in [
            ("resolution", "resolution"),
            ("occupancy_min_z", "occupancy_min_z"),
            ("point_cloud_min_z", "point_cloud_min_z"),
            ("sensor_model.max", "clamp_max"),
            ("network", "network"),
            ("filter_ground_plane", "filter_ground_plane"),
            ("ground_filter.angle", "ground_filter_angle"),
        ] {
            assert_eq!(field_of(name).as_deref(), Some(field));
        }
        for unknown in ["", "help", "params_file", "ground_filter", "sensor_model.hits"] {
            assert_eq!(field_of(unknown), None, "{unknown}");
        }
        for name in names() {
            assert!(field_of(&name).is_some(), "{name}");
        }
    }
}
