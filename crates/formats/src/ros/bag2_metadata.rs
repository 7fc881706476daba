/// Required parts of the `metadata.yaml` of a ROS 2 bag.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Bag2Metadata {
    /// Files in the order of their messages.
    pub(super) files: Vec<String>,
    /// Empty if the files are not compressed.
    pub(super) compression_format: String,
}

impl Bag2Metadata {
    /// Parses the lines of the two keys. `ros2 bag` and rosbags write each key once, outside of other lists.
    pub(super) fn of(text: &str) -> Self {
        let mut metadata = Self::default();
        let mut is_in_files = false;
        for line in text.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')) {
            if is_in_files {
                if let Some(item) = line.strip_prefix("- ") {
                    metadata.files.push(scalar(item));
                    continue;
                }
                is_in_files = false;
            }
            let Some((key, value)) = line.split_once(':') else { continue };
            match key.trim() {
                "relative_file_paths" if metadata.files.is_empty() => {
                    let list = value.trim().strip_prefix('[').and_then(|list| list.strip_suffix(']'));
                    match list {
                        Some(list) => {
                            let items = list.split(',').map(scalar).filter(|item| !item.is_empty());
                            metadata.files.extend(items);
                        }
                        None => is_in_files = true,
                    }
                }
                "compression_format" => metadata.compression_format = scalar(value),
                _ => {}
            }
        }
        metadata
    }
}

/// Removes the quotes of a value.
fn scalar(value: &str) -> String {
    let value = value.trim();
    let inner = ['"', '\''].iter().find_map(|&quote| value.strip_prefix(quote)?.strip_suffix(quote));
    inner.unwrap_or(value).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_follow_their_key_as_block_or_inline() {
        let text = "a:\n  relative_file_paths:\n    - x_0.db3\n    - \"x_1.db3\"\n  \
                    compression_format: ''\n  files:\n  - path: y\n";
        let metadata = Bag2Metadata::of(text);
        assert_eq!(metadata.files, ["x_0.db3", "x_1.db3"]);
        assert_eq!(metadata.compression_format, "");
        assert_eq!(Bag2Metadata::of("relative_file_paths: [a.mcap, 'b.mcap']").files, ["a.mcap", "b.mcap"]);
    }
}
