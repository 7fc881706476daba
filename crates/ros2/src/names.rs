use anyhow::{Context as _, anyhow, ensure};
use ros2_client::{Name, NodeName};

/// Names of the node, its topics and its services as others see them: in its namespace, and as a launch file maps them.
#[derive(Clone, Debug)]
pub struct Names {
    /// `/`, or without a slash at its end.
    namespace: String,
    node_name: String,
    /// Absolute names: what one is called, and what it is to be called.
    mapped: Vec<[String; 2]>,
}

/// Between the two names of a rule.
pub const BECOMES: &str = ":=";

impl Names {
    /// # Errors
    ///
    /// Rules that are none.
    pub fn new(namespace: &str, node_name: &str, rules: &[String]) -> anyhow::Result<Self> {
        let namespace = format!("/{}", namespace.trim_matches('/'));
        let mut names = Self { namespace, node_name: node_name.to_owned(), mapped: Vec::new() };
        for rule in rules {
            let [from, to] = names.of_rule(rule).with_context(|| format!("--remap {rule}"))?;
            names.mapped.push([from, to]);
        }
        Ok(names)
    }

    fn of_rule(&self, rule: &str) -> anyhow::Result<[String; 2]> {
        let both = rule.split_once(BECOMES);
        let (from, to) = both.ok_or_else(|| anyhow!("no rule; one looks like cloud_in:=/lidar/points"))?;
        ensure!(!from.contains("://"), "rules for topics or services alone are not known");
        let names = [self.absolute(from), self.absolute(to)];
        names.iter().try_for_each(|name| self::split(name).map(drop))?;
        Ok(names)
    }

    /// The name that others use, from the root on.
    pub fn full(&self, name: &str) -> String {
        let name = self.absolute(name);
        self.mapped.iter().find(|[from, _]| *from == name).map_or(name, |[_, to]| to.clone())
    }

    /// The namespace of the node; `/` for none.
    #[cfg(feature = "zenoh")]
    pub fn namespace(&self) -> &str {
        &self.namespace
    }

    /// The same as `ros2-client` takes it.
    ///
    /// # Errors
    ///
    /// A name that is none in ROS 2.
    pub fn of(&self, name: &str) -> anyhow::Result<Name> {
        let full = self.full(name);
        let (namespace, own) = split(&full)?;
        Name::new(namespace, own).map_err(|error| anyhow!("{full}: {error:?}"))
    }

    /// # Errors
    ///
    /// A name that is none in ROS 2.
    pub fn of_node(&self) -> anyhow::Result<NodeName> {
        NodeName::new(&self.namespace, &self.node_name).map_err(|error| {
            anyhow!("--namespace {}, --node-name {}: {error:?}", self.namespace, self.node_name)
        })
    }

    /// `/a` as it is, `a` in the namespace of the node, `~/a` under its name.
    fn absolute(&self, name: &str) -> String {
        let base = self.namespace.trim_end_matches('/');
        match name.strip_prefix("~/") {
            Some(own) => format!("{base}/{}/{own}", self.node_name),
            None if name.starts_with('/') => name.to_owned(),
            None => format!("{base}/{name}"),
        }
    }
}

/// Namespace and last part of an absolute name.
fn split(full: &str) -> anyhow::Result<(&str, &str)> {
    let is_name = |part: &str| {
        part.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    let is_right = full.strip_prefix('/').is_some_and(|bare| bare.split('/').all(is_name));
    ensure!(is_right, "{full:?} is no name of a topic or a service; one looks like /lidar/points");
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
    fn what_is_no_name_is_refused() {
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
