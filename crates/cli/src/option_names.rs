//! Replaces field names in messages of the library by options: `` `max_range` `` becomes `--max-range`.

use super::args::Cli;
use clap::CommandFactory as _;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{LazyLock, OnceLock};

/// Name of the running subcommand.
static SUBCOMMAND: OnceLock<String> = OnceLock::new();

/// Options of all subcommands by field name.
static OPTIONS: LazyLock<BTreeMap<String, String>> = LazyLock::new(|| options_of(|_| true));
/// Options of the running subcommand by field name.
static OWN_OPTIONS: LazyLock<BTreeMap<String, String>> =
    LazyLock::new(|| options_of(|subcommand| SUBCOMMAND.get().is_none_or(|name| name == subcommand)));

fn options_of(is_wanted: impl Fn(&str) -> bool) -> BTreeMap<String, String> {
    let command = Cli::command();
    let subcommands = command.get_subcommands().filter(|subcommand| is_wanted(subcommand.get_name()));
    let arguments = subcommands.flat_map(clap::Command::get_arguments);
    let longs = arguments.filter_map(clap::Arg::get_long);
    let mut options: BTreeMap<_, _> =
        longs.map(|long| (long.replace('-', "_"), format!("--{long}"))).collect();
    options.insert("insert_mode".to_owned(), "--insert".to_owned());
    options
}

/// Sets the running subcommand, before the first use of option names.
pub fn name_options_of(subcommand: &str) {
    SUBCOMMAND.get_or_init(|| subcommand.to_owned());
}

/// Replaces field names between backticks by options of any subcommand.
pub fn with_options(text: &str) -> Cow<'_, str> {
    if !text.contains('`') {
        return text.into();
    }
    let mut named = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, quoted)) = rest.split_once('`') {
        named += before;
        match quoted.split_once('`').and_then(|(field, after)| Some((OPTIONS.get(field)?, after))) {
            Some((option, after)) => {
                named += option;
                rest = after;
            }
            None => {
                named.push('`');
                rest = quoted;
            }
        }
    }
    (named + rest).into()
}

/// Replaces field names in a comma-separated list by options of the running subcommand. A value may follow a name.
/// Other names are unchanged.
pub fn option_of(argument: &str) -> String {
    let named = |part: &str| {
        let (name, value) = part.split_at(part.find(' ').unwrap_or(part.len()));
        OWN_OPTIONS.get(name).map_or_else(|| part.to_owned(), |option| format!("{option}{value}"))
    };
    argument.split(", ").map(named).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_become_options() {
        let of = with_options;
        assert_eq!(of("raise `max_range`, or `poses` FILE"), "raise --max-range, or --poses FILE");
        assert_eq!(of("`insert_mode` per-ray"), "--insert per-ray");
        assert_eq!(of("the topic `camera_info`; `voxtile repair`: `memory`"), {
            "the topic `camera_info`; `voxtile repair`: --memory"
        });
        assert_eq!(of("a ` alone, and `memory"), "a ` alone, and `memory");
        assert_eq!(option_of("topic /a, deskew, map.ot"), "--topic /a, --deskew, map.ot");
    }
}
