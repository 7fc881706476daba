use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use voxtile::Scan;
use voxtile_simulation::Survey;

/// A synthetic survey.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
pub enum SurveyName {
    /// 64 beams of 1024 rays, every metre of a drive through a city; mean range 12 m, at most 60 m
    Street,
    /// 90 000 rays, every half metre of a walk through a building; mean range 2.3 m, at most 20 m
    Indoor,
    /// Every metre of a drive through an endless city: mostly new streets; a fifth are revisited
    Drive,
    /// Every metre of a loop of 4 km through the city, repeated
    Laps,
    /// Every ten centimetres of a loop of 2.4 km through a warehouse, repeated: ten scans per second
    Warehouse,
    /// Each scan in a random street within 5 km
    Teleport,
    /// Each scan on a random mast of 50 m height within 5 km, with rays of up to 400 m
    Mast,
}

/// Streets along each side of a lap: 4 x 17 x 60 m.
const LAP_BLOCKS: u64 = 17;
/// Maximum distance of teleports and masts from the origin, in metres.
const REACH_M: f64 = 5_000.0;

impl SurveyName {
    /// Default number of rays of a scan.
    pub const RAYS: u32 = 8_000;

    /// Endless iterator over the scans from number `first`. Scans of city surveys have about `rays` rays; street and
    /// indoor have a fixed number. The same seed gives the same scans on every platform.
    pub fn scans(self, seed: u64, first: usize, rays: u32) -> Box<dyn Iterator<Item = Scan>> {
        match self {
            Self::Street => Box::new(Survey::street(seed).skip(first)),
            Self::Indoor => Box::new(Survey::indoor(seed).skip(first)),
            Self::Drive => Box::new(Survey::tour(seed, rays).skip(first)),
            Self::Laps => Box::new(Survey::laps(seed, LAP_BLOCKS, rays).skip(first)),
            Self::Warehouse => Box::new(Survey::warehouse(seed, rays).skip(first)),
            Self::Teleport => Box::new(Survey::teleports(seed, REACH_M, rays).skip(first)),
            Self::Mast => Box::new(Survey::masts(seed, REACH_M, rays).skip(first)),
        }
    }

    /// Distance between scans, in metres; `None` if the positions are random.
    pub fn spacing_m(self) -> Option<f64> {
        match self {
            Self::Street | Self::Drive | Self::Laps => Some(1.0),
            Self::Indoor => Some(0.5),
            Self::Warehouse => Some(0.1),
            Self::Teleport | Self::Mast => None,
        }
    }

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Street => "street",
            Self::Indoor => "indoor",
            Self::Drive => "drive",
            Self::Laps => "laps",
            Self::Warehouse => "warehouse",
            Self::Teleport => "teleport",
            Self::Mast => "mast",
        }
    }

    /// Label in a scan stream that identifies these scans.
    pub fn label(self, seed: u64, first: usize, rays: u32) -> String {
        let name = self.name();
        match self {
            Self::Street | Self::Indoor => format!("workload {name}, seed {seed}, from scan {first}"),
            _ => format!("workload {name}, seed {seed}, {rays} rays, from scan {first}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_match_the_command_line_and_labels_are_unique() {
        let mut labels = std::collections::BTreeSet::new();
        for survey in SurveyName::value_variants() {
            assert_eq!(SurveyName::from_str(survey.name(), false).as_ref(), Ok(survey));
            for (seed, first, rays) in [(1, 0, 8_000), (2, 0, 8_000), (1, 5, 8_000), (1, 0, 100)] {
                labels.insert(survey.label(seed, first, rays));
            }
        }
        // Two surveys have their own number of rays.
        assert_eq!(labels.len(), 7 * 4 - 2);
    }

    #[test]
    fn scans_begin_at_the_requested_number() {
        for &survey in SurveyName::value_variants() {
            let mut scans = survey.scans(1, 0, 200);
            let (second, alone) = (scans.nth(1), survey.scans(1, 1, 200).next());
            assert!(second.is_some() && second == alone, "{}", survey.name());
        }
    }
}
