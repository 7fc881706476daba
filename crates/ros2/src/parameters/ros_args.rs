use super::remark::Remark;
use crate::names::RULE_SEPARATOR;
use std::ffi::OsString;

/// Command line whose arguments between `--ros-args` and `--` are translated to options.
#[derive(Debug, Default, PartialEq)]
pub struct RosArgs {
    /// Command line with the translated options appended.
    pub arguments: Vec<OsString>,
    /// Names and YAML values of parameters.
    pub parameters: Vec<[String; 2]>,
    pub remarks: Vec<Remark>,
}

const BEGIN: &str = "--ros-args";
const END: &str = "--";

/// Arguments without effect: those with a value, then those without.
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
    /// Arguments that ROS does not define, and invalid rules or parameters.
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
                    text.ok_or_else(|| format!("{BEGIN}: {argument:?} is not valid Unicode"))
                };
                let argument = text(argument)?;
                if argument == BEGIN || SWITCHES.contains(&&*argument) {
                    continue;
                }
                let value = rest.next().ok_or_else(|| format!("{BEGIN}: {argument} needs a value"));
                let value = value.and_then(text)?;
                found.take(&argument, &value, &mut options)?;
            }
        }
        found.arguments.extend(options.into_iter().map(OsString::from));
        Ok(found)
    }

    fn take(&mut self, argument: &str, value: &str, options: &mut Vec<String>) -> Result<(), String> {
        match argument {
            "-r" | "--remap" => match value.split_once(RULE_SEPARATOR) {
                Some(("__node" | "__name", name)) => options.push(format!("--node-name={name}")),
                Some(("__ns", namespace)) => options.push(format!("--namespace={namespace}")),
                Some((from, _)) if !from.contains(':') => options.push(format!("--remap={value}")),
                Some(_) => {
                    return Err(format!(
                        "{argument} {value}: rules for a single node, only topics or only services are not supported"
                    ));
                }
                None => {
                    return Err(format!(
                        "{argument} {value}: expected FROM:=TO, such as cloud_in:=/lidar/points"
                    ));
                }
            },
            "-p" | "--param" => match value.split_once(RULE_SEPARATOR) {
                Some((name, value)) if !name.contains(':') => {
                    self.parameters.push([name.to_owned(), value.to_owned()]);
                }
                _ => {
                    return Err(format!("{argument} {value}: expected NAME:=VALUE, such as resolution:=0.1"));
                }
            },
            "--params-file" => options.push(format!("--params-file={value}")),
            known if WITHOUT_EFFECT.contains(&known) => {
                self.remarks.push(Remark::warning(format!("{known} {value} has no effect")));
            }
            unknown => return Err(format!("{BEGIN}: unknown argument {unknown}")),
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
    fn arguments_of_a_launch_file_are_translated() {
        let found = of("n -o m --ros-args -r __node:=mapper -r __ns:=/robot --params-file /tmp/p.yaml \
                        -p resolution:=0.1 --log-level info --disable-rosout-logs -r cloud_in:=/points -- --memory 1GB");
        let found = found.unwrap();
        let wanted = "n -o m --memory 1GB --node-name=mapper --namespace=/robot --params-file=/tmp/p.yaml \
                      --remap=cloud_in:=/points";
        assert_eq!(found.arguments, wanted.split(' ').map(OsString::from).collect::<Vec<_>>());
        assert_eq!(found.parameters, [["resolution".to_owned(), "0.1".to_owned()]]);
        // As in ROS, `--ros-args` may be empty.
        assert_eq!(of("n -o m --ros-args").unwrap().arguments.len(), 3);
    }

    #[test]
    fn invalid_arguments_are_refused() {
        for wrong in ["-r", "-r a", "-r other:a:=b", "-p a", "-p n:a:=1", "--never 1", "-x"] {
            assert!(of(&format!("n --ros-args {wrong}")).is_err(), "{wrong}");
        }
    }
}
