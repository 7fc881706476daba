use super::frame_links::Step;
use std::collections::HashSet;

/// Depth-first search from a frame upwards, with the most trusted parents first. Each frame is visited once, so that
/// loops terminate.
#[derive(Debug, Default)]
pub(super) struct Search<'a> {
    /// Steps to the wanted frame, if it is an ancestor.
    pub(super) route: Option<Vec<Step<'a>>>,
    /// Visited frames in order, starting with the frame itself.
    pub(super) frames: Vec<&'a str>,
    /// First frame without a step to a new frame: the root, in a tree.
    pub(super) end: Option<&'a str>,
    /// A frame that is its own ancestor.
    pub(super) looped: Option<&'a str>,
    /// Whether the search stopped at the limit of frames.
    pub(super) is_cut: bool,
}

/// Maximum number of frames to visit.
const MAX_FRAMES: usize = 10_000;

impl<'a> Search<'a> {
    /// Searches until a frame is wanted or all ancestors are visited.
    ///
    /// # Errors
    ///
    /// The steps of a frame cannot be read.
    pub(super) fn run<E>(
        from: &'a str,
        steps: &dyn Fn(&'a str) -> Result<Vec<Step<'a>>, E>,
        is_wanted: impl Fn(&str) -> bool,
    ) -> Result<Self, E> {
        let mut search = Self { frames: vec![from], ..Self::default() };
        let mut visited: HashSet<&str> = HashSet::from([from]);
        let (mut route, mut open): (Vec<Step<'a>>, _) = (Vec::new(), vec![steps(from)?.into_iter()]);
        while let Some(next) = open.last_mut() {
            let Some(step) = next.next() else {
                let at = route.pop().map_or(from, |step| step.parent);
                search.end.get_or_insert(at);
                open.pop();
                continue;
            };
            let parent = step.parent;
            if !visited.insert(parent) {
                if parent == from || route.iter().any(|before| before.parent == parent) {
                    search.looped.get_or_insert(parent);
                }
                continue;
            }
            search.frames.push(parent);
            route.push(step);
            if is_wanted(parent) {
                search.route = Some(route);
                return Ok(search);
            }
            if visited.len() >= MAX_FRAMES {
                search.is_cut = true;
                return Ok(search);
            }
            open.push(steps(parent)?.into_iter());
        }
        Ok(search)
    }
}
