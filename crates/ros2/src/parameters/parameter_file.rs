use super::remark::Remark;
use super::value::{Group, Placed, Value};
use anyhow::{Context as _, bail, ensure};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read as _;
use std::path::Path;

/// Key of a node's parameters in ROS 2.
const PARAMETERS: &str = "ros__parameters";
/// Name of the node whose sections are used if there are none for this node.
const OCTOMAP_SERVER: &str = "octomap_server";
const MAX_BYTES: u64 = 1 << 20;

/// Name of the node that reads a file.
#[derive(Clone, Debug)]
pub struct NodeName {
    /// With its namespace.
    pub full: String,
    /// Whether it is the default name, so that a file may be that of octomap_server.
    pub is_default: bool,
}

/// Parameters of a node by their full names.
pub type Parameters = BTreeMap<String, Placed>;

/// Reads the parameters of a node, by their full names. If several sections set a parameter, the most specific one
/// counts: the node's name, then `/*`, then `/**`.
///
/// # Errors
///
/// A file that cannot be read or is not a parameter file.
pub fn read(path: &Path, node: &NodeName, remarks: &mut Vec<Remark>) -> anyhow::Result<Parameters> {
    let mut text = String::new();
    let file = File::open(path).with_context(|| format!("cannot open {}", path.display()))?;
    let bytes = file.take(MAX_BYTES + 1).read_to_string(&mut text);
    let bytes = bytes.with_context(|| format!("cannot read {}", path.display()))?;
    ensure!(bytes as u64 <= MAX_BYTES, "{}: the file has more than {MAX_BYTES} bytes", path.display());
    of_text(&text, node, &path.display().to_string(), remarks)
}

fn of_text(
    text: &str,
    node: &NodeName,
    label: &str,
    remarks: &mut Vec<Remark>,
) -> anyhow::Result<Parameters> {
    let groups: Group = serde_saphyr::from_str(text).map_err(|error| {
        let line = error.location().map(|location| format!(":{}", location.line())).unwrap_or_default();
        anyhow::anyhow!("{label}{line}: {}", error.without_snippet())
    })?;
    let mut sections = Vec::new();
    collect("", &groups, label, &mut sections)?;
    let names = || sections.iter().map(|(name, _)| name.as_str());
    let is_called = |name: &str, last: &str| parts(name).next_back() == Some(last);
    let own: Vec<&str> = parts(&node.full).collect();
    let (&last, namespace) = own.split_last().unwrap_or((&"", &[]));
    let mut wanted = own.clone();
    if node.is_default
        && !names().any(|name| is_called(name, last))
        && let Some(section) = names().find(|name| is_called(name, OCTOMAP_SERVER))
    {
        wanted = [namespace, &[OCTOMAP_SERVER]].concat();
        remarks.push(Remark::info(format!("{label}: the section {section} is used for {}", node.full)));
    }
    let mut parameters = BTreeMap::new();
    for wildcard in [Some("**"), Some("*"), None] {
        for (name, section) in &sections {
            let name: Vec<&str> = parts(name).collect();
            let widest = ["**", "*"].into_iter().find(|wildcard| name.contains(wildcard));
            if widest == wildcard && is_for(&name, &wanted) {
                flatten("", section, &mut parameters);
            }
        }
    }
    if parameters.is_empty() {
        let names: Vec<&str> = names().collect();
        let node = &node.full;
        remarks.push(Remark::warning(format!("{label}: no parameters for {node}; sections are {names:?}")));
    }
    Ok(parameters)
}

fn parts(name: &str) -> impl DoubleEndedIterator<Item = &str> {
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
    groups: &'a Group,
    label: &str,
    into: &mut Vec<(String, &'a Group)>,
) -> anyhow::Result<()> {
    for (name, Placed { value, line }) in groups {
        let name = format!("{prefix}/{}", name.trim_matches('/'));
        let Value::Group(group) = value else {
            bail!("{label}:{line}: {name} is not a group with {PARAMETERS}")
        };
        match group.get(PARAMETERS).map(|placed| &placed.value) {
            Some(Value::Group(parameters)) => into.push((name, parameters)),
            Some(Value::Nothing) => {}
            None if !group.is_empty() => collect(&name, group, label, into)?,
            _ => bail!("{label}:{line}: {name} has no {PARAMETERS}"),
        }
    }
    Ok(())
}

/// Flattens nested groups into dotted names. `Value` limits the depth.
fn flatten(prefix: &str, group: &Group, into: &mut Parameters) {
    for (name, placed) in group {
        let name = format!("{prefix}{}", name.replace('/', "."));
        match &placed.value {
            Value::Group(group) => flatten(&format!("{name}."), group, into),
            _ => drop(into.insert(name, placed.clone())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str, node: &str) -> anyhow::Result<Parameters> {
        let node = NodeName { full: node.to_owned(), is_default: false };
        of_text(text, &node, "p.yaml", &mut Vec::new())
    }

    #[test]
    fn files_of_octomap_server_need_no_other_name() {
        let read = |text: &str, full: &str, is_default| {
            let (node, mut remarks) = (NodeName { full: full.to_owned(), is_default }, Vec::new());
            let found = of_text(text, &node, "p.yaml", &mut remarks).unwrap();
            let remarks: Vec<String> = remarks.into_iter().map(|remark| remark.text).collect();
            (found.into_keys().collect::<Vec<_>>().join(" "), remarks.join("; "))
        };
        let text = "octomap_server: {ros__parameters: {a: 1}}\n/**: {ros__parameters: {b: 1}}\n";
        let (found, remarks) = read(text, "/voxtile_ros2", true);
        assert_eq!((&*found, remarks.contains("/octomap_server is used for /voxtile_ros2")), ("a b", true));
        assert_eq!(read(text, "/voxtile_ros2", false).0, "b");
        let both = format!("{text}voxtile_ros2: {{ros__parameters: {{c: 1}}}}\n");
        assert_eq!(read(&both, "/voxtile_ros2", true), ("b c".to_owned(), String::new()));
        let named = "/robot/octomap_server: {ros__parameters: {a: 1}}";
        assert_eq!(read(named, "/robot/voxtile_ros2", true).0, "a");
        let (found, remarks) = read("other: {ros__parameters: {a: 1}}", "/voxtile_ros2", true);
        assert_eq!((&*found, remarks.contains("sections are [\"/other\"]")), ("", true));
    }

    #[test]
    fn errors_name_the_line() {
        let error = |text: &str| of(text, "n").unwrap_err().to_string();
        assert!(
            error("a:\n  ros__parameters:\n\tb: 1\n").starts_with("p.yaml:3: "),
            "{}",
            error("a:\n  b: {\n")
        );
        assert!(error("/a:\n  ros__parameters: {}\n/b: 7\n").starts_with("p.yaml:3: /b is not a group"));
        assert!(error("/a:\n  ros__parameters: {}\n/a:\n  ros__parameters: {}\n").starts_with("p.yaml:3: "));
    }

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
        let found = of(text, "voxtile_ros2").unwrap();
        let names: Vec<&str> = found.keys().map(String::as_str).collect();
        assert_eq!(names, ["cloud", "frame_id", "resolution", "sensor_model.hit", "sensor_model.max_range"]);
        let at = |name: &str| found.get(name).map(|placed| (placed.value.clone(), placed.line));
        assert_eq!(at("resolution"), Some((Value::Number(0.1), 3)));
        assert_eq!(at("sensor_model.max_range"), Some((Value::Whole(20), 4)));
        assert_eq!(at("frame_id"), Some((Value::Text("1".to_owned()), 12)));
        let third = of(text, "third").unwrap();
        assert_eq!(third.get("resolution").map(|placed| &placed.value), Some(&Value::Number(0.2)));
    }

    #[test]
    fn sections_match_nodes_in_a_namespace() {
        let names = |text: &str, node: &str| -> Vec<String> { of(text, node).unwrap().into_keys().collect() };
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
            assert!(of(wrong, "n").is_err(), "{wrong}");
        }
        for (open, close) in [("{a: ", "}"), ("[", "]")] {
            let deep = format!(
                "/**: {{ros__parameters: {{a: {}1{}}}}}",
                open.repeat(100_000),
                close.repeat(100_000)
            );
            assert!(of(&deep, "n").is_err(), "{open}");
        }
    }
}
