use std::path::{Component, Path};

/// Whether a name that a file gives leads to what is in its folder: data from elsewhere are not to open other files.
pub(crate) fn is_inside(name: &Path) -> bool {
    name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_below_are_inside() {
        for (name, wanted) in
            [("a.png", true), ("./depth/a..png", true), ("/a", false), ("../a", false), ("a/../../b", false)]
        {
            assert_eq!(is_inside(Path::new(name)), wanted, "{name}");
        }
    }
}
