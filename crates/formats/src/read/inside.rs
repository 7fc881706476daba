use std::path::{Component, Path};

/// Returns whether a file name found in data stays within its folder. Untrusted data must not open other files.
pub(crate) fn is_inside(name: &Path) -> bool {
    name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_descendants_are_inside() {
        for (name, wanted) in
            [("a.png", true), ("./depth/a..png", true), ("/a", false), ("../a", false), ("a/../../b", false)]
        {
            assert_eq!(is_inside(Path::new(name)), wanted, "{name}");
        }
    }
}
