use super::pcd::is_special;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// A longer header is an error.
const MAX_BYTES: u64 = 1 << 16;

/// The `VIEWPOINT` of a PCD file: x y z, and a quaternion w x y z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Viewpoint([f64; 7]);

impl Viewpoint {
    /// Whether it is the identity, which writers without a pose write.
    pub(super) fn is_identity(&self) -> bool {
        let [x, y, z, w, qx, qy, qz] = self.0;
        [x, y, z, qx, qy, qz].iter().all(|&number| number == 0.0) && w != 0.0
    }
}

/// The `VIEWPOINT` of a PCD file, without reading its points; `None` if there is no valid one, or no file.
pub(super) fn viewpoint_of_file(path: &Path) -> Option<Viewpoint> {
    if is_special(path) {
        return None;
    }
    let mut header = Vec::new();
    File::open(path).ok()?.take(MAX_BYTES).read_to_end(&mut header).ok()?;
    viewpoint_of(&header)
}

fn viewpoint_of(header: &[u8]) -> Option<Viewpoint> {
    for line in header.split(|&byte| byte == b'\n') {
        let line = String::from_utf8_lossy(line);
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("DATA") => return None,
            Some("VIEWPOINT") => {
                let numbers: Vec<f64> = words.map_while(|word| word.parse().ok()).collect();
                return numbers.try_into().ok().map(Viewpoint);
            }
            _ => {}
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewpoint_is_found_in_the_header_alone() {
        let is_identity = |text: &str| viewpoint_of(text.as_bytes()).map(|viewpoint| viewpoint.is_identity());
        assert_eq!(is_identity("FIELDS x\nVIEWPOINT 0 0 0 1 0 0 0\nDATA ascii\n"), Some(true));
        assert_eq!(is_identity("VIEWPOINT 0 0 1 1 0 0 0\r\nDATA ascii\n"), Some(false));
        assert_eq!(is_identity("FIELDS x\nDATA ascii\nVIEWPOINT 0 0 1 1 0 0 0\n"), None);
        assert_eq!(is_identity("VIEWPOINT 0 0 1\n"), None);
    }
}
