use super::name_stamps::NameStamps;
use std::cmp::Ordering;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};

/// Sorts files in natural order: `full2` before `full10`, and `9.5` before `10.25`.
///
/// Names of equal length are compared character by character, because their numbers are padded or hexadecimal.
pub(crate) fn sort_naturally(files: &mut [PathBuf]) {
    let length = |path: &PathBuf| path.file_name().unwrap_or_default().len();
    let is_padded = files.windows(2).all(|pair| length(&pair[0]) == length(&pair[1]));
    let are_decimals =
        !is_padded && files.iter().all(|path| decimal(path).is_some()) && !NameStamps::of(files).are_whole();
    files.sort_by(|a, b| {
        let letters = || a.file_name().cmp(&b.file_name());
        let order = match (is_padded, are_decimals) {
            (true, _) => Ordering::Equal,
            (false, true) => compare_decimals(decimal(a), decimal(b)),
            (false, false) => alphanumeric_sort::compare_str(name_of(a), name_of(b)),
        };
        order.then_with(letters)
    });
}

/// Returns the last component of a path, for messages.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// Splits a file name that is a decimal number, without its extension, into the digits before and after the point.
fn decimal(path: &Path) -> Option<(&str, &str)> {
    let stem = path.file_stem().and_then(OsStr::to_str)?;
    let (whole, part) = stem.split_once('.').unwrap_or((stem, ""));
    let is_number = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    (!whole.is_empty() && is_number(whole) && is_number(part)).then_some((whole, part))
}

fn compare_decimals(a: Option<(&str, &str)>, b: Option<(&str, &str)>) -> Ordering {
    let ((a, a_part), (b, b_part)) = (a.unwrap_or_default(), b.unwrap_or_default());
    let (a, b) = (a.trim_start_matches('0'), b.trim_start_matches('0'));
    let parts = || a_part.trim_end_matches('0').cmp(b_part.trim_end_matches('0'));
    a.len().cmp(&b.len()).then_with(|| a.cmp(b)).then_with(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted(names: &[&str]) -> Vec<String> {
        let mut files: Vec<PathBuf> = names.iter().map(|name| Path::new("a/b").join(name)).collect();
        sort_naturally(&mut files);
        files.iter().map(|path| name_of(path)).collect()
    }

    #[test]
    fn files_are_in_natural_order() {
        assert_eq!(
            sorted(&["full10.pcd", "full2.pcd", "full1.pcd"]),
            ["full1.pcd", "full2.pcd", "full10.pcd"]
        );
        assert_eq!(sorted(&["010.pcd", "002.pcd"]), ["002.pcd", "010.pcd"]);
        assert_eq!(
            sorted(&["9.5.pcd", "10.25.pcd", "10.3.pcd", "10.1.pcd"])[1..],
            ["10.1.pcd", "10.25.pcd", "10.3.pcd"]
        );
        // Nanoseconds without leading zeros.
        let names = ["1500000000.5000000.pcd", "1500000000.70000000.pcd", "1500000000.120000000.pcd"];
        assert_eq!(sorted(&[names[2], names[0], names[1]]), names);
        // Hexadecimal numbers of equal length.
        assert_eq!(sorted(&["0a1f.pcd", "0a10.pcd"]), ["0a10.pcd", "0a1f.pcd"]);
        assert_eq!(sorted(&["1.pcd", "01.pcd"]).len(), 2);
    }
}
