use super::depth_tum::frame;
use super::inside::is_inside;
use super::lines::Lines;
use super::regular::check_regular;
use super::text_line::comment_of;
use std::path::{Path, PathBuf};
use voxtile::Result;

/// List of the colour images of a TUM RGB-D data set, `rgb.txt`, in order of time. It is read along with the depth
/// images, so its length does not matter.
pub(super) struct ColourList {
    folder: PathBuf,
    lines: Lines,
    /// Image before the time asked for last, and the one after it.
    around: [Option<Image>; 2],
}

/// Stamp in nanoseconds and file.
type Image = (i64, PathBuf);

/// Maximum time between a depth image and its colour image: that of the data set's own tool `associate.py`.
const MAX_APART_NS: u64 = 20_000_000;

impl ColourList {
    /// Opens the list of a folder. Returns `None` if there is none.
    pub(super) fn of(folder: &Path) -> Result<Option<Self>> {
        let path = folder.join("rgb.txt");
        check_regular(&path)?;
        if !path.is_file() {
            return Ok(None);
        }
        let lines = Lines::open(&path)?;
        Ok(Some(Self { folder: folder.to_owned(), lines, around: [None, None] }))
    }

    /// Returns the image nearest to a time, if it is near enough.
    pub(super) fn at(&mut self, stamp_ns: i64) -> Result<Option<PathBuf>> {
        if self.around[0].as_ref().is_some_and(|(before_ns, _)| *before_ns > stamp_ns) {
            // The depth images are not in order of time.
            self.lines = Lines::open(&self.folder.join("rgb.txt"))?;
            self.around = [None, None];
        }
        loop {
            match &self.around[1] {
                Some((after_ns, _)) if *after_ns >= stamp_ns => break,
                _ => {}
            }
            let Some(next) = self.next()? else { break };
            let [_, after] = std::mem::take(&mut self.around);
            self.around = [after, Some(next)];
        }
        let near = self.around.iter().flatten().min_by_key(|(at_ns, _)| at_ns.abs_diff(stamp_ns));
        let near = near.filter(|(at_ns, _)| at_ns.abs_diff(stamp_ns) <= MAX_APART_NS);
        Ok(near.map(|(_, path)| path.clone()))
    }

    /// Reads the next image. Lines that are not images are skipped.
    fn next(&mut self) -> Result<Option<Image>> {
        while let Some((_, line)) = self.lines.next()? {
            let line = line.trim();
            if line.is_empty() || comment_of(line).is_some() {
                continue;
            }
            // Untrusted data must not open other files.
            if let Ok((stamp_ns, file)) = frame(line)
                && is_inside(Path::new(file))
            {
                return Ok(Some((stamp_ns, self.folder.join(file))));
            }
        }
        Ok(None)
    }
}
