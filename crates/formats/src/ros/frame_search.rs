use super::frame_links::Step;
use std::collections::HashSet;

/// A search from a frame upwards, through its parents in their order. Each frame is visited once, so that loops end.
#[derive(Debug, Default)]
pub(super) struct Search<'a> {
    /// The steps to the frame that was wanted, if it is above.
    pub(super) route: Option<Vec<Step<'a>>>,
    /// What was visited, in order, beginning with the frame itself.
    pub(super) frames: Vec<&'a str>,
    /// The first frame from which no step led to a new one: the root, in a tree.
    pub(super) end: Option<&'a str>,
    /// A frame that is its own ancestor.
    pub(super) looped: Option<&'a str>,
    /// Whether there were too many frames to visit all.
    pub(super) is_cut: bool,
}

/// Frames that a search visits.
const MAX_FRAMES: usize = 10_000;

impl<'a> Search<'a> {
    /// Searches until a frame is wanted, or all above is visited.
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
