use super::value::Value;
use anyhow::{Context as _, bail, ensure};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Key of a node's parameters in ROS 2.
const PARAMETERS: &str = "ros__parameters";
const MAX_BYTES: u64 = 1 << 20;

/// Reads the parameters of a node, by their full names. If several sections set a parameter, the most specific one
/// counts: the node's name, then `/*`, then `/**`.
///
/// # Errors
///
/// A file that cannot be read or is not a parameter file.
pub fn read(path: &Path, node: &str) -> anyhow::Result<BTreeMap<String, Value>> {
    let mut text = String::new();
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let bytes = file.take(MAX_BYTES + 1).read_to_string(&mut text);
    let bytes = bytes.with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(bytes as u64 <= MAX_BYTES, "{}: the file has more than {MAX_BYTES} bytes", path.display());
    of_text(&text, node).with_context(|| path.display().to_string())
}

fn of_text(text: &str, node: &str) -> anyhow::Result<BTreeMap<String, Value>> {
    let groups: BTreeMap<String, Value> = serde_saphyr::from_str(text)?;
    let mut sections = Vec::new();
    collect("", &groups, &mut sections)?;
    let node: Vec<&str> = parts(node).collect();
    let mut parameters = BTreeMap::new();
    for wildcard in [Some("**"), Some("*"), None] {
        for (name, section) in &sections {
            let name: Vec<&str> = parts(name).collect();
            let widest = ["**", "*"].into_iter().find(|wildcard| name.contains(wildcard));
            if widest == wildcard && is_for(&name, &node) {
                flatten("", section, &mut parameters);
            }
        }
    }
    if parameters.is_empty() {
        let names = sections.iter().map(|(name, _)| name);
        log::warn!("no parameters for /{}; sections are {:?}", node.join("/"), names.collect::<Vec<_>>());
    }
    Ok(parameters)
}

fn parts(name: &str) -> impl Iterator<Item = &str> {
    name.split('/').filter(|part| !part.is_empty())
}

/// Returns whether a section name with wildcards matches a node: `*` matches one part, `**` any number of parts.
fn is_for(section: &[&str], node: &[&str]) -> bool {
    match (section, node) {
        ([], []) => true,
        (["**", rest @ ..], _) => {
            (0..=node.len()).any(|at| node.get(at..).is_some_and(|node| is_for(rest, node)))
        }
        ([first, rest @ ..], [own, node @ ..]) => (*first == "*" || first == own) && is_for(rest, node),
        _ => false,
    }
}

/// Collects the parameter groups with the names of their nodes. Namespaces may be groups themselves.
fn collect<'a>(
    prefix: &str,
    groups: &'a BTreeMap<String, Value>,
    into: &mut Vec<(String, &'a BTreeMap<String, Value>)>,
) -> anyhow::Result<()> {
    for (name, group) in groups {
        let name = format!("{prefix}/{}", name.trim_matches('/'));
        let Value::Group(group) = group else { bail!("{name} is not a group with {PARAMETERS}") };
        match group.get(PARAMETERS) {
            Some(Value::Group(parameters)) => into.push((name, parameters)),
            Some(Value::Nothing(())) => {}
            None if !group.is_empty() => collect(&name, group, into)?,
            _ => bail!("{name} has no {PARAMETERS}"),
        }
    }
    Ok(())
}

/// Flattens nested groups into dotted names. The YAML reader limits the depth.
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
    fn a_node_name_overrides_wildcards_and_groups_are_flattened() {
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
    fn sections_match_nodes_in_a_namespace() {
        let names =
            |text: &str, node: &str| -> Vec<String> { of_text(text, node).unwrap().into_keys().collect() };
        let text = "\
robot: {front: {ros__parameters: {a: 1}}, rear: {ros__parameters: {b: 1}}}
/robot/*: {ros__parameters: {c: 1}}
/**/front: {ros__parameters: {d: 1}}
front: {ros__parameters: {e: 1}}
/*: {ros__parameters: {f: 1}}
/nothing: {ros__parameters: }
";
        assert_eq!(names(text, "/robot/front"), ["a", "c", "d"]);
        assert_eq!(names(text, "/robot/rear"), ["b", "c"]);
        assert_eq!(names(text, "/front"), ["d", "e", "f"]);
        assert_eq!(names(text, "/a/robot/front"), ["d"]);
    }

    #[test]
    fn invalid_parameter_files_are_refused() {
        for wrong in ["7", "- a", "/**: 7", "/**: {resolution: 0.1}", "{", "a: &x [*x]", "/**: {a: 1, a: 2}"]
        {
            assert!(of_text(wrong, "n").is_err(), "{wrong}");
        }
        let deep = format!("/**: {{ros__parameters: {}1{}}}", "{a: ".repeat(100_000), "}".repeat(100_000));
        assert!(of_text(&deep, "n").is_err());
    }
}
