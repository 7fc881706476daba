use clap::ValueEnum;
use voxtile::Scan;
use voxtile::simulation::Survey;

/// Which of the made-up surveys.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum SurveyName {
    /// 64 beams of 1024 rays, every metre of a drive through a city; mean range 12 m, at most 60 m
    Street,
    /// 90 000 rays, every half metre of a walk through a building; mean range 2.3 m, at most 20 m
    Indoor,
}

impl SurveyName {
    /// The scans from number `first` on, without end. The same seed gives the same scans on every platform.
    pub fn scans(self, seed: u64, first: usize) -> Box<dyn Iterator<Item = Scan>> {
        match self {
            Self::Street => Box::new(Survey::street(seed).skip(first)),
            Self::Indoor => Box::new(Survey::indoor(seed).skip(first)),
        }
    }
}
