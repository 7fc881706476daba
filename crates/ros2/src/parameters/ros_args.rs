use crate::names::BECOMES;
use std::ffi::OsString;

/// A command line without what stands between `--ros-args` and `--`, as launch files write it; most of that is options.
#[derive(Debug, Default, PartialEq)]
pub struct RosArgs {
    /// The command line, with these options behind.
    pub arguments: Vec<OsString>,
    /// Names and values of parameters, in YAML.
    pub parameters: Vec<[String; 2]>,
}

const BEGIN: &str = "--ros-args";
const END: &str = "--";

/// What changes nothing here, with a value and without.
const WITHOUT_EFFECT: [&str; 5] = ["--log-level", "--log-config-file", "--log-file-name", "--enclave", "-e"];
const SWITCHES: [&str; 6] = [
    "--enable-rosout-logs",
    "--disable-rosout-logs",
    "--enable-stdout-logs",
    "--disable-stdout-logs",
    "--enable-external-lib-logs",
    "--disable-external-lib-logs",
];

impl RosArgs {
    /// # Errors
    ///
    /// What ROS does not know, or rules and parameters that are none.
    pub fn of(arguments: &[OsString]) -> Result<Self, String> {
        let mut found = Self::default();
        let mut options: Vec<String> = Vec::new();
        let mut rest = arguments.iter();
        while let Some(argument) = rest.next() {
            if argument != BEGIN {
                found.arguments.push(argument.clone());
                continue;
            }
            while let Some(argument) = rest.next().filter(|argument| *argument != END) {
                let text = |argument: &OsString| {
                    let text = argument.to_str().map(str::to_owned);
                    text.ok_or_else(|| format!("{BEGIN}: {argument:?} is no text"))
                };
                let argument = text(argument)?;
                if argument == BEGIN || SWITCHES.contains(&&*argument) {
                    continue;
                }
                let value = rest.next().ok_or_else(|| format!("{BEGIN}: nothing follows {argument}"));
                let value = value.and_then(text)?;
                found.take(&argument, &value, &mut options)?;
            }
        }
        found.arguments.extend(options.into_iter().map(OsString::from));
        Ok(found)
    }

    fn take(&mut self, argument: &str, value: &str, options: &mut Vec<String>) -> Result<(), String> {
        match argument {
            "-r" | "--remap" => match value.split_once(BECOMES) {
                Some(("__node" | "__name", name)) => options.push(format!("--node-name={name}")),
                Some(("__ns", namespace)) => options.push(format!("--namespace={namespace}")),
                Some((from, _)) if !from.contains(':') => options.push(format!("--remap={value}")),
                Some(_) => {
                    return Err(format!(
                        "{argument} {value}: rules for one node, or for topics or services alone, are not known"
                    ));
                }
                None => {
                    return Err(format!(
                        "{argument} {value}: no rule; one looks like cloud_in:=/lidar/points"
                    ));
                }
            },
            "-p" | "--param" => match value.split_once(BECOMES) {
                Some((name, value)) if !name.contains(':') => {
                    self.parameters.push([name.to_owned(), value.to_owned()]);
                }
                _ => return Err(format!("{argument} {value}: no parameter; one looks like resolution:=0.1")),
            },
            "--params-file" => options.push(format!("--params-file={value}")),
            known if WITHOUT_EFFECT.contains(&known) => log::warn!("{known} {value} has no effect here"),
            unknown => return Err(format!("{BEGIN}: {unknown} is not known")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(line: &str) -> Result<RosArgs, String> {
        let arguments: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        RosArgs::of(&arguments)
    }

    #[test]
    fn a_line_of_a_launch_file() {
        let found = of("n -o m --ros-args -r __node:=mapper -r __ns:=/robot --params-file /tmp/p.yaml \
                        -p resolution:=0.1 --log-level info --disable-rosout-logs -r cloud_in:=/points -- --memory 1GB");
        let found = found.unwrap();
        let wanted = "n -o m --memory 1GB --node-name=mapper --namespace=/robot --params-file=/tmp/p.yaml \
                      --remap=cloud_in:=/points";
        assert_eq!(found.arguments, wanted.split(' ').map(OsString::from).collect::<Vec<_>>());
        assert_eq!(found.parameters, [["resolution".to_owned(), "0.1".to_owned()]]);
        // As ROS does, it may stand there for nothing.
        assert_eq!(of("n -o m --ros-args").unwrap().arguments.len(), 3);
    }

    #[test]
    fn what_is_none_is_told() {
        for wrong in ["-r", "-r a", "-r other:a:=b", "-p a", "-p n:a:=1", "--never 1", "-x"] {
            assert!(of(&format!("n --ros-args {wrong}")).is_err(), "{wrong}");
        }
    }
}
