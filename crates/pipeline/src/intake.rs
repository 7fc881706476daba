use crate::scan_queue::ScanQueue;
use crate::scan_reader::{Read, ReadScan, ScanReader};
use std::collections::{HashSet, VecDeque};
use std::path::{Path, PathBuf};
use voxtile::scan::{ScanPoints, ScanTracer};
use voxtile::sensor::SensorModel;
use voxtile::space::Grid;
use voxtile::store::InputContent;
use voxtile::{Error, FormatError, Place};
use voxtile_formats::{ScanChain, ScanMark, StoredScan};

/// Scans among which the first with points is looked for: it tells which input this is.
const LEAD: usize = 16;
/// Most bad places of an input that may be skipped. All scans of a damaged chunk of a recording are at one place.
const MAX_BAD_PLACES: usize = 1000;
/// Most scans of an input that may be skipped: a map stores the number of each.
const MAX_SKIPPED: usize = 10_000;

/// The scans of an input in order, and what the map is to remember of those that it has taken.
pub struct Intake {
    reader: ScanReader,
    scans: PathBuf,
    /// What was read to tell which input this is, and not taken yet.
    lead: VecDeque<Read>,
    /// What came behind scans that were taken together, and is no scan.
    behind: Option<voxtile::Result<Read>>,
    chain: ScanChain,
    begins_with: Option<String>,
    skipped: Vec<u64>,
    /// The bytes of files at which scans were skipped, and how many were skipped at no such place.
    bad_places: HashSet<(PathBuf, u64)>,
    skipped_alone: usize,
    skips_bad: bool,
    /// What a scan with rays needs. `None` for points alone.
    rays: Option<RayNeeds>,
    /// Why scans were skipped by this process.
    pub unread: Vec<String>,
    /// How many scans were left out because they came faster than they could be mapped.
    pub left_out: u64,
}

/// What a map needs of scans whose rays it takes.
pub struct RayNeeds {
    pub grid: Grid,
    pub sensor_model: SensorModel,
}

/// What came of asking for scans to map.
pub enum Next {
    Scans(Vec<Taken>),
    End,
    Stopped,
}

/// A scan, and what has been taken of the input with it.
pub struct Taken {
    pub scan: StoredScan,
    pub content: InputContent,
}

impl Intake {
    pub fn new(reader: ScanReader, scans: PathBuf, skips_bad: bool, rays: Option<RayNeeds>) -> Self {
        let (lead, chain) = (VecDeque::new(), ScanChain::default());
        let (skipped, unread, left_out) = Default::default();
        let (behind, begins_with) = (None, None);
        let (bad_places, skipped_alone) = Default::default();
        Self {
            reader,
            scans,
            lead,
            behind,
            chain,
            begins_with,
            skipped,
            bad_places,
            skipped_alone,
            skips_bad,
            rays,
            unread,
            left_out,
        }
    }

    /// See [`ScanReader::read_ahead`].
    pub fn read_ahead(&mut self, queue: ScanQueue) {
        self.reader.read_ahead(queue);
    }

    /// Reads what tells which input this is; `false` if it was asked to stop before that had come.
    pub fn read_lead(&mut self) -> anyhow::Result<bool> {
        while self.lead.len() < LEAD && self.begins_with.is_none() {
            match self.reader.next(&mut || Ok(()))? {
                Read::Stopped => return Ok(false),
                Read::End => break,
                read => {
                    if let Read::Scan(ReadScan { mark, .. }) = &read
                        && mark.has_points()
                    {
                        self.begins_with = Some(mark.scan_text());
                    }
                    self.lead.push_back(read);
                }
            }
        }
        Ok(true)
    }

    /// The first scan of what has been read, if there is any.
    fn first(&self) -> Option<&StoredScan> {
        self.lead.iter().find_map(|read| match read {
            Read::Scan(ReadScan { scan, .. }) => Some(scan),
            _ => None,
        })
    }

    /// The error of a first scan that cannot be mapped, where it is not to be skipped.
    pub fn check_first(&mut self) -> anyhow::Result<()> {
        if let (Some(needs), Some(scan)) = (&self.rays, self.first())
            && needs.sensor_model.needs_intensity()
            && !scan.has_intensities()
        {
            // If the first has none, none has.
            needs.check_fields(scan)?;
        }
        match self.lead.pop_front().map(|first| self.judged(first)) {
            Some(Read::Unread(error)) if !self.skips_bad => Err(error.into()),
            first => {
                first.into_iter().for_each(|first| self.lead.push_front(first));
                Ok(())
            }
        }
    }

    /// A scan that cannot be mapped is as one that cannot be read.
    fn judged(&self, read: Read) -> Read {
        let Some(needs) = &self.rays else { return read };
        match read {
            Read::Scan(scan) => match needs.check(&scan.scan, self.chain.scans(), &self.scans) {
                Ok(()) => Read::Scan(scan),
                Err(error) => Read::Unread(error),
            },
            other => other,
        }
    }

    /// What the first scan with points is.
    pub fn begins_with(&self) -> Option<&str> {
        self.begins_with.as_deref()
    }

    /// Whether an input of which a map has this is as this one begins.
    pub fn begins_as(&self, content: &InputContent) -> bool {
        let (Some(_), None) = (&self.begins_with, &content.begins_with) else {
            return content.begins_with == self.begins_with;
        };
        // The map has only the scans without points that come first; without any, nothing identifies the input.
        if content.scans == 0 {
            return false;
        }
        let (mut chain, mut reads) = (ScanChain::default(), self.lead.iter());
        while chain.scans() < content.scans {
            match reads.next() {
                // Skipped, whether it can be read or not.
                Some(Read::Unread(_) | Read::Scan(_)) if content.skipped.contains(&chain.scans()) => {
                    chain.add_unread();
                }
                Some(Read::LeftOut(mark) | Read::Scan(ReadScan { mark, .. })) => chain.add(mark),
                _ => return false,
            }
        }
        chain.scan_text() == content.scan_chain
    }

    /// How maps of earlier versions know this input; `None` if it was asked to stop before that was known.
    pub fn fingerprint(&mut self) -> anyhow::Result<Option<voxtile::Result<String>>> {
        self.reader.fingerprint()
    }

    /// What a person should know of the input so far.
    pub fn remarks(&mut self) -> Vec<String> {
        self.reader.remarks().unwrap_or_default()
    }

    /// The coordinate reference system that the input names.
    pub fn crs(&mut self) -> Option<String> {
        self.reader.crs().unwrap_or_default()
    }

    /// What has been taken so far.
    pub fn content(&self) -> InputContent {
        InputContent {
            scans: self.chain.scans(),
            begins_with: self.begins_with.clone(),
            scan_chain: self.chain.scan_text(),
            pose_chain: self.chain.pose_text(),
            skipped: self.skipped.clone(),
        }
    }

    /// Passes over scans that a map has taken, which must be the same; `false` if it was asked to stop before the end.
    ///
    /// # Errors
    ///
    /// Fewer scans, other scans, other poses, a scan that cannot be read any more.
    pub fn pass_over(&mut self, content: &InputContent) -> anyhow::Result<bool> {
        self.skipped.clone_from(&content.skipped);
        if !self.pass(content.scans)? {
            return Ok(false);
        }
        let differs = match (
            self.chain.scan_text() == content.scan_chain,
            // Once the map was remapped, nothing tells by which poses.
            content.pose_chain.is_empty() || self.chain.pose_text() == content.pose_chain,
        ) {
            (true, true) => return Ok(true),
            (true, false) => "the same scans have other poses than",
            (false, _) => "they are not",
        };
        Err(self.wrong(format!(
            "of its first {} scans, the map has taken all, but {differs} those that it took: what changed cannot be taken \
             back; build another map, or add all of them once more with `append` `again`",
            content.scans
        )))
    }

    /// The same where the map does not know more than their number.
    pub fn pass(&mut self, scans: u64) -> anyhow::Result<bool> {
        while self.chain.scans() < scans {
            let number = self.chain.scans();
            let was_skipped = self.skipped.binary_search(&number).is_ok();
            match self.read(&mut || Ok(()))? {
                Read::Stopped => return Ok(false),
                Read::End => {
                    let reason = format!("has {number} scans, and the map has taken {scans} from it");
                    return Err(self.wrong(reason));
                }
                Read::Scan(_) if was_skipped => {
                    log::warn!("{}: scan {number} was skipped, and stays so", self.scans.display());
                    self.skipped_alone += 1;
                    self.chain.add_unread();
                }
                Read::Unread(error) if was_skipped => {
                    self.count_bad(&error);
                    self.chain.add_unread();
                }
                Read::LeftOut(mark) => self.chain.add(&mark),
                Read::Scan(ReadScan { mark, .. }) => self.chain.add(&mark),
                Read::Unread(error) => {
                    let context = format!("scan {number}, which the map has taken, cannot be read any more");
                    return Err(anyhow::Error::new(error).context(context));
                }
            }
        }
        Ok(true)
    }

    /// The next scans, which count as taken from now on: one, and up to `most` if they are at hand. While none comes,
    /// `idle` is called ten times a second.
    pub fn next(
        &mut self,
        most: usize,
        idle: &mut dyn FnMut() -> voxtile::Result<()>,
    ) -> anyhow::Result<Next> {
        let mut taken = loop {
            match self.read(idle)? {
                Read::Stopped => return Ok(Next::Stopped),
                Read::End => return Ok(Next::End),
                Read::Scan(scan) => break vec![self.took(scan)],
                Read::LeftOut(mark) => self.leave_out(&mark),
                Read::Unread(error) => self.skip(error)?,
            }
        };
        while taken.len() < most
            && let Some(read) = self.read_at_hand()
        {
            match read {
                Ok(Read::Scan(scan)) => taken.push(self.took(scan)),
                Ok(Read::LeftOut(mark)) => self.leave_out(&mark),
                other => {
                    self.behind = Some(other);
                    break;
                }
            }
        }
        Ok(Next::Scans(taken))
    }

    fn took(&mut self, ReadScan { scan, mark }: ReadScan) -> Taken {
        self.chain.add(&mark);
        Taken { scan, content: self.content() }
    }

    fn leave_out(&mut self, mark: &ScanMark) {
        self.chain.add(mark);
        self.left_out += 1;
    }

    fn skip(&mut self, error: Error) -> anyhow::Result<()> {
        if !self.skips_bad {
            return Err(error.into());
        }
        self.count_bad(&error);
        let excess = match () {
            () if self.skipped.len() >= MAX_SKIPPED => Some(format!("{MAX_SKIPPED} scans")),
            () if self.skipped_alone + self.bad_places.len() > MAX_BAD_PLACES => {
                Some(format!("{MAX_BAD_PLACES} scans or damaged chunks"))
            }
            () => None,
        };
        if let Some(excess) = excess {
            let context = format!(
                "more than {excess} of one input cannot be read: copy or repair the input and go on with `resume`, or \
                 build from later scans with `first`"
            );
            return Err(anyhow::Error::new(error).context(context));
        }
        let number = self.chain.scans();
        log::warn!("scan {number} is skipped: {error:#}");
        self.unread.push(format!("scan {number}: {error:#}"));
        self.skipped.push(number);
        self.chain.add_unread();
        Ok(())
    }

    /// Counts a scan that is skipped, unless another one was skipped at the same place.
    fn count_bad(&mut self, error: &Error) {
        match error {
            Error::Malformed { path, cause } if cause.place == Place::Offset => {
                self.bad_places.insert((path.clone(), cause.at));
            }
            _ => self.skipped_alone += 1,
        }
    }

    fn read(&mut self, idle: &mut dyn FnMut() -> voxtile::Result<()>) -> anyhow::Result<Read> {
        let read = match self.read_before() {
            Some(read) => read?,
            None => self.reader.next(idle)?,
        };
        Ok(self.judged(read))
    }

    fn read_at_hand(&mut self) -> Option<voxtile::Result<Read>> {
        let read = self.read_before().or_else(|| self.reader.next_at_hand())?;
        Some(read.map(|read| self.judged(read)))
    }

    /// What was read before and not taken.
    fn read_before(&mut self) -> Option<voxtile::Result<Read>> {
        self.behind.take().or_else(|| self.lead.pop_front().map(Ok))
    }

    fn wrong(&self, reason: String) -> anyhow::Error {
        Error::argument(self.scans.display().to_string(), reason).into()
    }
}

impl RayNeeds {
    /// Whether a scan, the one of this number of an input, can be mapped.
    fn check(&self, scan: &StoredScan, number: u64, input: &Path) -> voxtile::Result<()> {
        let origin = scan.origin();
        if self.grid.voxel_of(origin).is_none() {
            let StoredScan { name, .. } = scan;
            let reason = format!(
                "the sensor of scan {name} is at {origin:?} m, which is not finite or too far away for a voxel index: \
                 mend its pose, or leave the scan out with `skip_bad`"
            );
            return Err(FormatError::at_record(number, reason).in_input(input));
        }
        self.check_fields(scan)
    }

    fn check_fields(&self, scan: &StoredScan) -> voxtile::Result<()> {
        ScanTracer::check(&self.grid, &self.sensor_model, scan)
    }
}
