use crate::scan_input::ScanInput;
use crate::scan_queue::ScanQueue;
use crate::scan_reader::{Read, ReadScan, ScanReader};
use std::collections::{HashSet, VecDeque};
use std::path::PathBuf;
use voxtile::scan::{ScanPoints, ScanTracer};
use voxtile::sensor::SensorModel;
use voxtile::space::Grid;
use voxtile::store::InputContent;
use voxtile::{Error, FormatError, Place};
use voxtile_formats::{ScanChain, ScanFingerprint, StoredScan};

/// Number of scans to search for the first one with points, which identifies the input.
const LOOKAHEAD: usize = 16;
/// Maximum number of unreadable places in an input. All scans of a damaged chunk of a recording count as one place.
const MAX_BAD_PLACES: usize = 1000;
/// Maximum number of skipped scans of an input. The map stores the number of each.
const MAX_SKIPPED: usize = 10_000;

/// Sequence of the scans of an input, and the record of the accepted ones for the map.
pub struct Ingest {
    reader: ScanReader,
    input: ScanInput,
    /// Scans that were read to identify the input and are not yet inserted.
    lookahead: VecDeque<Read>,
    /// Result of a read that ended a batch of scans and is not a scan itself; returned by the next request.
    pending: Option<voxtile::Result<Read>>,
    chain: ScanChain,
    begins_with: Option<String>,
    skipped: Vec<u64>,
    /// File offsets at which scans were skipped.
    bad_places: HashSet<(PathBuf, u64)>,
    /// Number of skipped scans without a file offset.
    skipped_alone: usize,
    skips_bad: bool,
    /// Requirements for scans with rays. `None` for points without rays.
    rays: Option<RayNeeds>,
    /// Scans skipped by this process, with the reasons.
    pub unread: Vec<String>,
    /// Number of scans that were dropped because they arrived faster than they could be inserted.
    pub left_out: u64,
}

/// Requirements of a map for scans with rays.
pub struct RayNeeds {
    pub grid: Grid,
    pub sensor_model: SensorModel,
}

/// Result of requesting scans.
pub enum Next {
    Scans(Vec<Taken>),
    End,
    Stopped,
}

/// A scan, and the state of the input up to it.
pub struct Taken {
    pub scan: StoredScan,
    pub content: InputContent,
}

impl Ingest {
    pub fn new(reader: ScanReader, input: ScanInput, skips_bad: bool, rays: Option<RayNeeds>) -> Self {
        let (lookahead, chain) = (VecDeque::new(), ScanChain::default());
        let (skipped, unread, left_out) = Default::default();
        let (pending, begins_with) = (None, None);
        let (bad_places, skipped_alone) = Default::default();
        Self {
            reader,
            input,
            lookahead,
            pending,
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

    /// Reads the scans that identify the input. Returns `false` if reading was stopped.
    pub fn read_lookahead(&mut self) -> anyhow::Result<bool> {
        while self.lookahead.len() < LOOKAHEAD && self.begins_with.is_none() {
            match self.reader.next(&mut || Ok(()))? {
                Read::Stopped => return Ok(false),
                Read::End => break,
                read => {
                    if let Read::Scan(ReadScan { fingerprint, .. }) = &read
                        && fingerprint.has_points()
                    {
                        self.begins_with = Some(fingerprint.scan_text());
                    }
                    self.lookahead.push_back(read);
                }
            }
        }
        Ok(true)
    }

    /// Returns the first scan that was read ahead, if any.
    fn first(&self) -> Option<&StoredScan> {
        self.lookahead.iter().find_map(|read| match read {
            Read::Scan(ReadScan { scan, .. }) => Some(scan),
            _ => None,
        })
    }

    /// Returns an error if the first scan cannot be mapped and such scans are not skipped.
    pub fn check_first(&mut self) -> anyhow::Result<()> {
        if let (Some(needs), Some(scan)) = (&self.rays, self.first())
            && needs.sensor_model.needs_intensity()
            && !scan.has_intensities()
        {
            // All scans of an input have the same fields.
            needs.check_fields(scan)?;
        }
        match self.lookahead.pop_front().map(|first| self.judged(first)) {
            Some(Read::Unread(error)) if !self.skips_bad => Err(error.into()),
            first => {
                first.into_iter().for_each(|first| self.lookahead.push_front(first));
                Ok(())
            }
        }
    }

    /// Replaces a scan that cannot be mapped by its error, as for a scan that cannot be read.
    fn judged(&self, read: Read) -> Read {
        let Some(needs) = &self.rays else { return read };
        match read {
            Read::Scan(scan) => match needs.check(&scan.scan, self.chain.scans(), &self.input) {
                Ok(()) => Read::Scan(scan),
                Err(error) => Read::Unread(error),
            },
            other => other,
        }
    }

    /// Returns the fingerprint of the first scan with points.
    pub fn begins_with(&self) -> Option<&str> {
        self.begins_with.as_deref()
    }

    /// Returns whether this input starts like the input with this content in the map.
    pub fn begins_as(&self, content: &InputContent) -> bool {
        let (Some(_), None) = (&self.begins_with, &content.begins_with) else {
            return content.begins_with == self.begins_with;
        };
        // The recorded input begins with empty scans. If no scan was recorded, nothing identifies it.
        if content.scans == 0 {
            return false;
        }
        let (mut chain, mut reads) = (ScanChain::default(), self.lookahead.iter());
        while chain.scans() < content.scans {
            match reads.next() {
                // The earlier build skipped this scan, so skip it again, even if it is readable now.
                Some(Read::Unread(_) | Read::Scan(_)) if content.skipped.contains(&chain.scans()) => {
                    chain.add_unread();
                }
                Some(Read::LeftOut(fingerprint) | Read::Scan(ReadScan { fingerprint, .. })) => {
                    chain.add(fingerprint)
                }
                _ => return false,
            }
        }
        chain.scan_text() == content.scan_chain
    }

    /// Returns the fingerprint used in maps of older versions, or `None` if reading was stopped.
    pub fn fingerprint(&mut self) -> anyhow::Result<Option<voxtile::Result<String>>> {
        self.reader.fingerprint()
    }

    /// Returns remarks for the user about the input so far.
    pub fn remarks(&mut self) -> Vec<String> {
        self.reader.remarks().unwrap_or_default()
    }

    /// Returns the coordinate reference system named by the input.
    pub fn crs(&mut self) -> Option<String> {
        self.reader.crs().unwrap_or_default()
    }

    /// Returns the record of the input up to the last accepted scan.
    pub fn content(&self) -> InputContent {
        InputContent {
            scans: self.chain.scans(),
            begins_with: self.begins_with.clone(),
            scan_chain: self.chain.scan_text(),
            pose_chain: self.chain.pose_text(),
            skipped: self.skipped.clone(),
        }
    }

    /// Skips the scans that the map has, and checks that they are the same. Returns `false` if reading was stopped.
    ///
    /// # Errors
    ///
    /// There are fewer scans than in the map, scans or poses differ, or a scan cannot be read any more.
    pub fn pass_over(&mut self, content: &InputContent) -> anyhow::Result<bool> {
        self.skipped.clone_from(&content.skipped);
        if !self.pass(content.scans)? {
            return Ok(false);
        }
        let differs = match (
            self.chain.scan_text() == content.scan_chain,
            // A remapped map does not record the poses.
            content.pose_chain.is_empty() || self.chain.pose_text() == content.pose_chain,
        ) {
            (true, true) => return Ok(true),
            (true, false) => "their poses have changed",
            (false, _) => "they have changed",
        };
        Err(self.wrong(format!(
            "the map already has its first {} scans, but {differs}: changed scans cannot be removed from the map; \
             build another map, or add all scans again with `append` `again`",
            content.scans
        )))
    }

    /// Skips a number of scans without comparing them.
    pub fn pass(&mut self, scans: u64) -> anyhow::Result<bool> {
        while self.chain.scans() < scans {
            let number = self.chain.scans();
            let was_skipped = self.skipped.binary_search(&number).is_ok();
            match self.read(&mut || Ok(()))? {
                Read::Stopped => return Ok(false),
                Read::End => {
                    let reason = format!("has {number} scans, but the map already has {scans} scans of it");
                    return Err(self.wrong(reason));
                }
                Read::Scan(_) if was_skipped => {
                    log::warn!("{}: scan {number} was skipped before and remains skipped", self.input);
                    self.skipped_alone += 1;
                    self.chain.add_unread();
                }
                Read::Unread(error) if was_skipped => {
                    self.count_bad(&error);
                    self.chain.add_unread();
                }
                Read::LeftOut(fingerprint) => self.chain.add(&fingerprint),
                Read::Scan(ReadScan { fingerprint, .. }) => self.chain.add(&fingerprint),
                Read::Unread(error) => {
                    let context =
                        format!("scan {number}, which the map already has, cannot be read any more");
                    return Err(anyhow::Error::new(error).context(context));
                }
            }
        }
        Ok(true)
    }

    /// Accepts the next scan and, if they are already read, further ones up to `most`. While none arrives, `idle` is
    /// called ten times a second.
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
                Read::LeftOut(fingerprint) => self.leave_out(&fingerprint),
                Read::Unread(error) => self.skip(error)?,
            }
        };
        while taken.len() < most
            && let Some(read) = self.read_ready()
        {
            match read {
                Ok(Read::Scan(scan)) => taken.push(self.took(scan)),
                Ok(Read::LeftOut(fingerprint)) => self.leave_out(&fingerprint),
                other => {
                    self.pending = Some(other);
                    break;
                }
            }
        }
        Ok(Next::Scans(taken))
    }

    fn took(&mut self, ReadScan { scan, fingerprint }: ReadScan) -> Taken {
        self.chain.add(&fingerprint);
        Taken { scan, content: self.content() }
    }

    fn leave_out(&mut self, fingerprint: &ScanFingerprint) {
        self.chain.add(fingerprint);
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
                "more than {excess} of one input cannot be read: copy or repair the input and continue with `resume`, \
                 or start with later scans with `first`"
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

    /// Counts the places of skipped scans. Several scans at the same place count once.
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

    fn read_ready(&mut self) -> Option<voxtile::Result<Read>> {
        let read = self.read_before().or_else(|| self.reader.next_ready())?;
        Some(read.map(|read| self.judged(read)))
    }

    /// Returns a result of an earlier read that was not used yet.
    fn read_before(&mut self) -> Option<voxtile::Result<Read>> {
        self.pending.take().or_else(|| self.lookahead.pop_front().map(Ok))
    }

    fn wrong(&self, reason: String) -> anyhow::Error {
        Error::argument(self.input.to_string(), reason).into()
    }
}

impl RayNeeds {
    /// Checks that a scan can be mapped. `number` is its number in the input.
    fn check(&self, scan: &StoredScan, number: u64, input: &ScanInput) -> voxtile::Result<()> {
        let origin = scan.origin();
        if self.grid.voxel_of(origin).is_none() {
            let StoredScan { name, .. } = scan;
            let reason = format!(
                "the sensor of scan {name} is at {origin:?} m, which is not finite or too far away for a voxel index: \
                 correct its pose, or skip the scan with `skip_bad`"
            );
            return Err(FormatError::at_record(number, reason).in_input(input.first()));
        }
        self.check_fields(scan)
    }

    fn check_fields(&self, scan: &StoredScan) -> voxtile::Result<()> {
        ScanTracer::check(&self.grid, &self.sensor_model, scan)
    }
}
