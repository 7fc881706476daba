use super::ray_end::RayEnd;
use super::ray_origin::RayOrigin;
use super::window::{Local, PAGE_EDGE, Window};

/// Which pages of a window rays leave something in; in the others they are followed without a trace.
#[derive(Clone, Copy, Debug)]
pub(super) enum PageChoice<'a> {
    /// All, and what lies outside the window.
    All,
    /// These, by their numbers.
    Only(&'a [u32]),
    /// All others, and what lies outside the window.
    AllBut(&'a [u32]),
}

/// The pages of a window through which rays go, as far as a look from place to place tells, in order of their numbers.
pub(super) fn pages_on_the_way(
    window: &Window,
    origin: &RayOrigin,
    ends: impl Iterator<Item = RayEnd>,
) -> Vec<u32> {
    let mut is_met = vec![false; window.pages().iter().map(|&pages| pages as usize).product()];
    let base = window.base().map(f64::from);
    for end in ends {
        let way: [f64; 3] = std::array::from_fn(|k| end.point[k] - origin.point[k]);
        let longest = way.iter().fold(0.0, |longest: f64, part| longest.max(part.abs()));
        // Twice a page, and no more often than across the window, whatever the way.
        let looks = (longest / (PAGE_EDGE / 2) as f64).ceil().clamp(1.0, 256.0);
        for look in 0..=looks as u32 {
            let share = f64::from(look) / looks;
            let local: Local = std::array::from_fn(|k| (origin.point[k] - base[k] + share * way[k]) as u32);
            if window.holds(local) {
                is_met[window.page_of(local)] = true;
            }
        }
    }
    (0..).zip(is_met).filter_map(|(page, is_met)| is_met.then_some(page)).collect()
}

/// The pages of a window in groups of at most `most`, every page in one; the last group is all that is left, with those that
/// were not `met`.
pub(super) fn in_groups(met: &[u32], most: usize) -> Vec<PageChoice<'_>> {
    let groups = met.len().div_ceil(most.max(1)).max(1);
    let each = met.len().div_ceil(groups).max(1);
    let listed = each * (groups - 1);
    let mut choices: Vec<_> = met[..listed].chunks(each).map(PageChoice::Only).collect();
    choices.push(if listed == 0 { PageChoice::All } else { PageChoice::AllBut(&met[..listed]) });
    choices
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_page_is_in_one_group() {
        for count in [0, 1, 5, 10, 11] {
            let met: Vec<u32> = (0..count).map(|k| 3 * k).collect();
            for most in [0, 1, 3, 100] {
                let groups = in_groups(&met, most);
                for page in 0..40 {
                    let holds = |choice: &&PageChoice<'_>| match choice {
                        PageChoice::All => true,
                        PageChoice::Only(pages) => pages.contains(&page),
                        PageChoice::AllBut(pages) => !pages.contains(&page),
                    };
                    assert_eq!(groups.iter().filter(holds).count(), 1, "page {page}, {count} met, {most}");
                }
                let is_small = |choice: &PageChoice<'_>| match choice {
                    PageChoice::Only(pages) => pages.len() <= most.max(1),
                    PageChoice::AllBut(pages) => met.len() - pages.len() <= most.max(1),
                    PageChoice::All => met.len() <= most.max(1),
                };
                assert!(groups.iter().all(is_small));
            }
        }
    }
}
