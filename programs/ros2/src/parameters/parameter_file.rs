use super::value::Value;
use anyhow::{Context as _, bail, ensure};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// The name under which ROS 2 keeps the parameters of a node.
const PARAMETERS: &str = "ros__parameters";
const MOST_BYTES: u64 = 1 << 20;

/// The parameters that a file has for a node, by their full names; of two for one name the later section counts, in the
/// order of their wildcards: `/**`, then `/*`, then the node by name.
///
/// # Errors
///
/// A file that cannot be read, or is no parameter file.
pub fn read(path: &Path, node_name: &str) -> anyhow::Result<BTreeMap<String, Value>> {
    let mut text = String::new();
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let bytes = file.take(MOST_BYTES + 1).read_to_string(&mut text);
    let bytes = bytes.with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(bytes as u64 <= MOST_BYTES, "{}: more than {MOST_BYTES} bytes are no parameters", path.display());
    of_text(&text, node_name).with_context(|| path.display().to_string())
}

fn of_text(text: &str, node_name: &str) -> anyhow::Result<BTreeMap<String, Value>> {
    let sections: BTreeMap<String, Value> = serde_saphyr::from_str(text)?;
    let mut parameters = BTreeMap::new();
    let absolute = format!("/{node_name}");
    for wanted in [&["/**", "**"][..], &["/*", "*"], &[node_name, &absolute]] {
        for (name, section) in sections.iter().filter(|(name, _)| wanted.contains(&name.as_str())) {
            let Value::Group(section) = section else { bail!("{name} is no group with {PARAMETERS}") };
            match section.get(PARAMETERS) {
                Some(Value::Group(group)) => flatten("", group, &mut parameters),
                Some(Value::Nothing(())) => {}
                _ => bail!("{name} has no {PARAMETERS}"),
            }
        }
    }
    if parameters.is_empty() {
        log::warn!("no parameters for /{node_name}; sections are {:?}", sections.keys());
    }
    Ok(parameters)
}

/// Groups are parts of names. How deep they can be the reader of YAML limits.
fn flatten(prefix: &str, group: &BTreeMap<String, Value>, into: &mut BTreeMap<String, Value>) {
    for (name, value) in group {
        let name = format!("{prefix}{}", name.replace('/', "."));
        match value {
            Value::Group(group) => flatten(&format!("{name}."), group, into),
            value => drop(into.insert(name, value.clone())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_node_by_name_wins_over_wildcards_and_groups_are_parts_of_names() {
        let text = "\
voxtile_ros2:
  ros__parameters:
    resolution: 0.1
    sensor_model: {max_range: 20}
/other:
  ros__parameters: {resolution: 7}
/**:
  ros__parameters:
    resolution: 0.2
    sensor_model/hit: 0.8
    cloud: [/a, /b]
    frame_id: \"1\"
";
        let found = of_text(text, "voxtile_ros2").unwrap();
        let names: Vec<&str> = found.keys().map(String::as_str).collect();
        assert_eq!(names, ["cloud", "frame_id", "resolution", "sensor_model.hit", "sensor_model.max_range"]);
        assert_eq!(found.get("resolution"), Some(&Value::Number(0.1)));
        assert_eq!(found.get("sensor_model.max_range"), Some(&Value::Whole(20)));
        assert_eq!(found.get("frame_id"), Some(&Value::Text("1".to_owned())));
        assert_eq!(of_text(text, "third").unwrap().get("resolution"), Some(&Value::Number(0.2)));
    }

    #[test]
    fn what_is_no_parameter_file_is_an_error() {
        for wrong in ["7", "- a", "/**: 7", "/**: {resolution: 0.1}", "{", "a: &x [*x]", "/**: {a: 1, a: 2}"]
        {
            assert!(of_text(wrong, "n").is_err(), "{wrong}");
        }
        let deep = format!("/**: {{ros__parameters: {}1{}}}", "{a: ".repeat(100_000), "}".repeat(100_000));
        assert!(of_text(&deep, "n").is_err());
    }
}
