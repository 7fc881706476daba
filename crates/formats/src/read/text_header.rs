//! Parts of a text of points before its points: column names, units and the separator.

use super::columns::Meaning;
use super::text_line::{Separator, without_end};
use super::units::LengthUnit;

/// Splits a line into column names.
pub(super) fn names_of(line: &str) -> Vec<String> {
    let tab = Separator::Char('\t');
    let has_tabs = line.trim().contains('\t') && !tab.split(line.trim()).contains(&"");
    let separator = if has_tabs { tab } else { Separator::of(line) };
    let cells = separator.split(line);
    let mut names: Vec<String> = Vec::new();
    for cell in without_end(&cells) {
        // In a blank-separated line, `x (cm)` is two words.
        match names.last_mut().filter(|_| separator == Separator::Blank) {
            Some(name) if cell.starts_with(['[', '(']) || is_open(name) => {
                name.push(' ');
                name.push_str(cell);
            }
            _ => names.push((*cell).to_owned()),
        }
    }
    names
}

/// Returns whether a name has an unclosed bracket.
fn is_open(name: &str) -> bool {
    let last = name.rfind(['[', '(', ']', ')']).and_then(|at| name.get(at..));
    last.is_some_and(|rest| rest.starts_with(['[', '(']))
}

/// Returns the separator requested by a first line `sep=;`, as in Excel.
pub(super) fn requested_separator(line: &str) -> Option<Separator> {
    let lower = line.trim().trim_matches('"').to_ascii_lowercase();
    let mut mark = lower.strip_prefix("sep=")?.chars();
    let separator = mark.next().map_or(Separator::Char('\t'), Separator::Char);
    mark.next().is_none().then_some(separator)
}

/// Returns the units of x, y and z from a row of units below the names.
pub(super) fn units_row(cells: &[&str], meaning: &Meaning) -> Option<[LengthUnit; 3]> {
    let unit = |at: usize| {
        let cell = cells.get(at)?.trim_matches(['[', ']', '(', ')', '{', '}', '<', '>', ' ']);
        LengthUnit::named(&cell.to_lowercase())
    };
    let [x, y, z] = meaning.xyz;
    Some([unit(x)?, unit(y)?, unit(z)?])
}

/// Returns the unit of length mentioned in a comment, unless it is metres: `units: mm`, `all values in cm`.
pub(super) fn unit_of_comment(comment: &str) -> Option<LengthUnit> {
    let lower = comment.to_lowercase();
    let words: Vec<&str> =
        lower.split(|letter: char| !letter.is_alphanumeric()).filter(|word| !word.is_empty()).collect();
    let unit = |word: &&str| LengthUnit::named(word).filter(|_| *word != "in");
    let after = |at: usize| words.iter().skip(at + 1);
    let found = words.iter().enumerate().find_map(|(at, word)| match *word {
        "unit" | "units" => after(at).take(3).find_map(unit),
        "in" => after(at).next().and_then(unit),
        _ => None,
    });
    found.filter(|unit| *unit != LengthUnit::METRE)
}

/// Returns whether these are column names of poses.
pub(super) fn are_poses(names: &[String]) -> bool {
    ["qx", "qy", "qz", "qw"].iter().all(|wanted| names.iter().any(|name| name.eq_ignore_ascii_case(wanted)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn column_names_are_split() {
        for (line, wanted) in [
            ("x y z", vec!["x", "y", "z"]),
            ("x (cm) y [cm] z (cm) t", vec!["x (cm)", "y [cm]", "z (cm)", "t"]),
            ("v [m s^-1] x", vec!["v [m s^-1]", "x"]),
            ("\"X, m\",\"Y, m\",Z,", vec!["X, m", "Y, m", "Z"]),
            ("x coordinate\ty coordinate", vec!["x coordinate", "y coordinate"]),
            ("x\t\ty", vec!["x", "y"]),
            ("X;Y;Z", vec!["X", "Y", "Z"]),
        ] {
            assert_eq!(names_of(line), wanted, "{line}");
        }
    }

    #[test]
    fn units_and_separators_are_detected() {
        assert_eq!(requested_separator("sep=;"), Some(Separator::Char(';')));
        assert_eq!(requested_separator("\"SEP=,\""), Some(Separator::Char(',')));
        assert_eq!(requested_separator("separate"), None);
        let meaning = Meaning::of_metres([1, 2, 3]);
        assert_eq!(units_row(&["s", "[mm]", "(mm)", "mm"], &meaning).map(|units| units[0].name), Some("mm"));
        assert_eq!(units_row(&["s", "px", "px", "px"], &meaning), None);
        for (comment, wanted) in [
            (" Units: mm", Some("mm")),
            ("unit of length = centimeter", Some("cm")),
            ("x y z in mm", Some("mm")),
            ("units are in feet", Some("ft")),
            ("units: m", None),
            ("made in Germany", None),
            ("points in the frame of the sensor", None),
        ] {
            assert_eq!(unit_of_comment(comment).map(|unit| unit.name), wanted, "{comment}");
        }
    }
}
