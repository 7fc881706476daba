use anyhow::{Context as _, anyhow, ensure};
use ros2_client::{Name, NodeName};

/// Resolves names of topics and services: in the node's namespace, after the remapping rules of launch files.
#[derive(Clone, Debug)]
pub struct Names {
    /// `/`, or an absolute name without a trailing slash.
    namespace: String,
    node_name: String,
    /// Pairs of absolute names: from, to.
    remapped: Vec<[String; 2]>,
}

/// Separator of the two names in a remapping rule.
pub const RULE_SEPARATOR: &str = ":=";

impl Names {
    /// # Errors
    ///
    /// Invalid remapping rules.
    pub fn new(namespace: &str, node_name: &str, rules: &[String]) -> anyhow::Result<Self> {
        let namespace = format!("/{}", namespace.trim_matches('/'));
        let mut names = Self { namespace, node_name: node_name.to_owned(), remapped: Vec::new() };
        for rule in rules {
            let [from, to] = names.of_rule(rule).with_context(|| format!("--remap {rule}"))?;
            names.remapped.push([from, to]);
        }
        Ok(names)
    }

    fn of_rule(&self, rule: &str) -> anyhow::Result<[String; 2]> {
        let both = rule.split_once(RULE_SEPARATOR);
        let (from, to) = both.ok_or_else(|| anyhow!("expected FROM:=TO, such as cloud_in:=/lidar/points"))?;
        ensure!(!from.contains("://"), "rules for only topics or only services are not supported");
        let names = [self.absolute(from), self.absolute(to)];
        names.iter().try_for_each(|name| self::split(name).map(drop))?;
        Ok(names)
    }

    /// Returns the absolute name after remapping.
    pub fn full(&self, name: &str) -> String {
        let name = self.absolute(name);
        self.remapped.iter().find(|[from, _]| *from == name).map_or(name, |[_, to]| to.clone())
    }

    /// Returns the namespace of the node; `/` for none.
    #[cfg(feature = "zenoh")]
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// Returns the absolute name after remapping as a name of `ros2-client`.
    ///
    /// # Errors
    ///
    /// A name that is invalid in ROS 2.
    pub fn of(&self, name: &str) -> anyhow::Result<Name> {
        let full = self.full(name);
        let (namespace, own) = split(&full)?;
        Name::new(namespace, own).map_err(|error| anyhow!("{full}: {error:?}"))
    }

    /// # Errors
    ///
    /// A name that is invalid in ROS 2.
    pub fn of_node(&self) -> anyhow::Result<NodeName> {
        NodeName::new(&self.namespace, &self.node_name).map_err(|error| {
            anyhow!("--namespace {}, --node-name {}: {error:?}", self.namespace, self.node_name)
        })
    }

    /// Makes a name absolute: `/a` is unchanged, `a` is in the namespace of the node, `~/a` is below its name.
    fn absolute(&self, name: &str) -> String {
        let base = self.namespace.trim_end_matches('/');
        match name.strip_prefix("~/") {
            Some(own) => format!("{base}/{}/{own}", self.node_name),
            None if name.starts_with('/') => name.to_owned(),
            None => format!("{base}/{name}"),
        }
    }
}

/// Splits an absolute name into namespace and last part.
fn split(full: &str) -> anyhow::Result<(&str, &str)> {
    let is_name = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let is_right = full.strip_prefix('/').is_some_and(|bare| bare.split('/').all(is_name));
    ensure!(
        is_right,
        "{full:?} is not a valid name of a topic or service; expected a name such as /lidar/points"
    );
    let (namespace, own) = full.rsplit_once('/').unwrap_or_default();
    Ok((if namespace.is_empty() { "/" } else { namespace }, own))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_in_the_namespace_and_rules_map_them() {
        let rules = ["cloud_in:=/lidar/points", "~/save:=keep", "/tf:=tf", "cloud_in:=second"];
        let names = Names::new("/robot/", "mapper", &rules.map(str::to_owned)).unwrap();
        assert_eq!(names.full("octomap_binary"), "/robot/octomap_binary");
        assert_eq!(names.full("cloud_in"), "/lidar/points");
        assert_eq!(names.full("/robot/cloud_in"), "/lidar/points");
        assert_eq!(
            (names.full("~/save"), names.full("~/reset")),
            ("/robot/keep".into(), "/robot/mapper/reset".into())
        );
        assert_eq!((names.full("/tf"), names.full("/tf_static")), ("/robot/tf".into(), "/tf_static".into()));
        assert!(names.of("~/save").is_ok() && names.of_node().is_ok());
        let plain = Names::new("/", "n", &[]).unwrap();
        assert_eq!((plain.full("cloud_in"), plain.full("~/save")), ("/cloud_in".into(), "/n/save".into()));
    }

    #[test]
    fn invalid_names_are_refused() {
        for rule in ["cloud_in", "a:=", ":=b", "a b:=c", "rostopic://a:=b", "a:=b//c"] {
            assert!(Names::new("/", "n", &[rule.to_owned()]).is_err(), "{rule}");
        }
        let names = Names::new("/", "n", &[]).unwrap();
        for wrong in ["", "/", "a//b", "9a", "a b", "/a/"] {
            assert!(names.of(wrong).is_err(), "{wrong}");
        }
        assert!(Names::new("/a b", "n", &[]).unwrap().of_node().is_err());
    }
}
