use crate::scan_input::{ScanInput, ScanInputs};
use crate::scan_place::LocalScans;
use crate::scan_queue::{ScanQueue, is_last};
use crate::watch::Watch;
use anyhow::bail;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::Duration;
use voxtile::Error;
use voxtile::scan::Stop;
use voxtile_formats::{PointBudget, PoseSource, ReadOptions, ScanFingerprint, ScanSource, StoredScan};

/// Maximum time to wait for the input before checking for a stop request.
const PATIENCE: Duration = Duration::from_millis(100);

/// Error for a reading thread that ended unexpectedly, for instance by a panic.
const READER_IS_GONE: &str = "the thread that reads the scans ended before the end of the input";

/// Reads an input scan by scan in its own thread, so that waiting for it can be stopped. Scans are read on request or a
/// few in advance. If no thread can be created, scans are read in the calling thread.
pub struct ScanReader {
    worker: Worker,
    stop: Stop,
    /// Queue of scans that are read in advance.
    ahead: Option<Arc<ScanQueue>>,
    /// Removes fetched files when dropped. The thread does not own them, because it is never joined and may still run
    /// when the process ends.
    _scans: LocalScans,
}

/// Properties of an open input.
pub struct Opened {
    pub name: String,
    pub scans: Option<usize>,
    pub poses: PoseSource,
}

/// Function that computes the fingerprint of a scan.
pub type FingerprintFn = fn(&StoredScan) -> voxtile::Result<ScanFingerprint>;

/// A scan with its fingerprint.
pub struct ReadScan {
    pub scan: StoredScan,
    pub fingerprint: ScanFingerprint,
}

/// Result of requesting a scan.
pub enum Read {
    Scan(ReadScan),
    /// A scan that cannot be read. The next call returns the following scan.
    Unread(Error),
    /// A scan that was dropped because too many were queued.
    LeftOut(ScanFingerprint),
    End,
    /// Reading was stopped.
    Stopped,
}

enum Worker {
    Thread { requests: Sender<Request>, answers: Receiver<Answer> },
    Here(Box<dyn ScanSource + Send>, PointBudget, FingerprintFn),
}

enum Request {
    Scan,
    Fingerprint,
    Remarks,
    Crs,
    /// Read into a queue until the end of the input.
    Ahead(Arc<ScanQueue>),
}

enum Answer {
    Opened(voxtile::Result<Opened>),
    Read(voxtile::Result<Read>),
    Fingerprint(voxtile::Result<String>),
    Remarks(Vec<String>),
    Crs(Option<String>),
}

impl ScanReader {
    /// Opens an input. Returns `None` if it was stopped before.
    pub fn open(
        scans: ScanInput,
        options: ReadOptions,
        budget: PointBudget,
        fingerprint: FingerprintFn,
        watch: Watch,
    ) -> anyhow::Result<Option<(Self, Opened)>> {
        let (requests, requests_in) = channel();
        let (answers_out, answers) = channel();
        let local = match LocalScans::of_inputs(ScanInputs::from(scans.clone()), &watch) {
            Err(Error::Stopped) => return Ok(None),
            local => local?,
        };
        let (inputs, own_options, here) = (local.inputs().clone(), options.clone(), budget.clone());
        let (named, own_watch, stop) = (scans.clone(), watch.clone(), watch.stop().clone());
        let read = move || {
            let mut source = match inputs.open(&own_options, &own_watch) {
                Ok(source) => source,
                Err(error) => return drop(answers_out.send(Answer::Opened(Err(error)))),
            };
            let opened = Opened::of(&named, &*source);
            let mut is_wanted = answers_out.send(Answer::Opened(Ok(opened))).is_ok();
            while is_wanted && let Ok(request) = requests_in.recv() {
                match request {
                    Request::Ahead(queue) => read_ahead(&mut *source, &budget, fingerprint, &queue),
                    request => {
                        is_wanted =
                            answers_out.send(answer(&mut *source, &request, &budget, fingerprint)).is_ok();
                    }
                }
            }
        };
        match thread::Builder::new().name("voxtile-read".to_owned()).spawn(read) {
            Ok(_) => {
                let mut reader =
                    Self { worker: Worker::Thread { requests, answers }, stop, ahead: None, _scans: local };
                match reader.wait(&mut || Ok(()))? {
                    Some(Answer::Opened(Err(Error::Stopped))) => Ok(None),
                    Some(Answer::Opened(opened)) => Ok(Some((reader, opened?))),
                    _ => Ok(None),
                }
            }
            Err(error) => {
                log::warn!(
                    "cannot start a thread for reading, so stop requests take effect only when the input \
                            responds: {error}"
                );
                let source = local.inputs().open(&options, &watch)?;
                let opened = Opened::of(&scans, &*source);
                Ok(Some((
                    Self {
                        worker: Worker::Here(source, here, fingerprint),
                        stop,
                        ahead: None,
                        _scans: local,
                    },
                    opened,
                )))
            }
        }
    }

    /// Starts to read scans in advance into a queue. Has no effect without a thread.
    pub fn read_ahead(&mut self, queue: ScanQueue) {
        if let Worker::Thread { requests, .. } = &self.worker {
            let queue = Arc::new(queue);
            // If the thread has ended, the next wait reports it.
            drop(requests.send(Request::Ahead(queue.clone())));
            self.ahead = Some(queue);
        }
    }

    /// Returns the next scan. While waiting, `idle` is called ten times a second.
    pub fn next(&mut self, idle: &mut dyn FnMut() -> voxtile::Result<()>) -> anyhow::Result<Read> {
        if let Some(queue) = &self.ahead {
            return take(queue, &self.stop, idle);
        }
        match self.request_answer(Request::Scan, idle)? {
            Some(Answer::Read(read)) => Ok(read?),
            _ => Ok(Read::Stopped),
        }
    }

    /// Returns the next scan if it is already read.
    pub fn next_ready(&mut self) -> Option<voxtile::Result<Read>> {
        self.ahead.as_ref().and_then(|queue| queue.take(Duration::ZERO))
    }

    /// Returns the fingerprint used in maps of older versions, or `None` if reading was stopped.
    pub fn fingerprint(&mut self) -> anyhow::Result<Option<voxtile::Result<String>>> {
        match self.request_answer(Request::Fingerprint, &mut || Ok(()))? {
            Some(Answer::Fingerprint(fingerprint)) => Ok(Some(fingerprint)),
            _ => Ok(None),
        }
    }

    /// Stops reading and returns remarks for the user about the input. Returns no remarks if the thread is still
    /// waiting for the input.
    pub fn remarks(&mut self) -> anyhow::Result<Vec<String>> {
        let is_ahead = self.ahead.as_ref().map(|queue| queue.close()).is_some();
        let mut patience = 10;
        let mut impatient = || {
            patience -= 1;
            if is_ahead && patience == 0 { Err(Error::Stopped) } else { Ok(()) }
        };
        match self.request_answer(Request::Remarks, &mut impatient)? {
            Some(Answer::Remarks(remarks)) => Ok(remarks),
            _ => Ok(Vec::new()),
        }
    }

    /// Returns the coordinate reference system that the input has named so far.
    pub fn crs(&mut self) -> anyhow::Result<Option<String>> {
        match self.request_answer(Request::Crs, &mut || Ok(()))? {
            Some(Answer::Crs(crs)) => Ok(crs),
            _ => Ok(None),
        }
    }

    fn request_answer(
        &mut self,
        request: Request,
        idle: &mut dyn FnMut() -> voxtile::Result<()>,
    ) -> anyhow::Result<Option<Answer>> {
        match &mut self.worker {
            Worker::Here(..) if self.stop.is_set() => return Ok(None),
            Worker::Here(source, budget, fingerprint) => {
                return Ok(Some(answer(&mut **source, &request, budget, *fingerprint)));
            }
            // If the thread has ended, the next wait reports it.
            Worker::Thread { requests, .. } => drop(requests.send(request)),
        }
        self.wait(idle)
    }

    fn wait(&mut self, idle: &mut dyn FnMut() -> voxtile::Result<()>) -> anyhow::Result<Option<Answer>> {
        let Worker::Thread { answers, .. } = &self.worker else { return Ok(None) };
        loop {
            if self.stop.is_set() {
                return Ok(None);
            }
            match answers.recv_timeout(PATIENCE) {
                Ok(answer) => return Ok(Some(answer)),
                Err(RecvTimeoutError::Timeout) => idle()?,
                Err(RecvTimeoutError::Disconnected) => bail!(READER_IS_GONE),
            }
        }
    }
}

impl Drop for ScanReader {
    fn drop(&mut self) {
        self.ahead.iter().for_each(|queue| queue.close());
    }
}

impl Opened {
    fn of(scans: &ScanInput, source: &dyn ScanSource) -> Self {
        let name = scans.name(source);
        Self { name, scans: source.len_hint(), poses: source.pose_source() }
    }
}

fn take(
    queue: &Arc<ScanQueue>,
    stop: &Stop,
    idle: &mut dyn FnMut() -> voxtile::Result<()>,
) -> anyhow::Result<Read> {
    while !stop.is_set() {
        // The reading thread owns a reference to the queue until it has pushed the last scan or panicked.
        let is_ours_alone = Arc::strong_count(queue) == 1;
        match queue.take(PATIENCE) {
            Some(read) => return Ok(read?),
            None if is_ours_alone => bail!(READER_IS_GONE),
            None => idle()?,
        }
    }
    Ok(Read::Stopped)
}

/// Reads an input until its end or until the queue is closed.
fn read_ahead(
    source: &mut dyn ScanSource,
    budget: &PointBudget,
    fingerprint: FingerprintFn,
    queue: &ScanQueue,
) {
    loop {
        let read = read(source, budget, fingerprint);
        let is_last = is_last(&read);
        if !queue.push(read) || is_last {
            return;
        }
    }
}

fn answer(
    source: &mut dyn ScanSource,
    request: &Request,
    budget: &PointBudget,
    fingerprint: FingerprintFn,
) -> Answer {
    match request {
        Request::Scan => Answer::Read(read(source, budget, fingerprint)),
        Request::Fingerprint => Answer::Fingerprint(source.fingerprint()),
        Request::Remarks => Answer::Remarks(source.remarks()),
        Request::Crs | Request::Ahead(_) => Answer::Crs(source.crs()),
    }
}

fn read(
    source: &mut dyn ScanSource,
    budget: &PointBudget,
    fingerprint: FingerprintFn,
) -> voxtile::Result<Read> {
    match source.next_stored(budget) {
        Ok(Some(scan)) => {
            let fingerprint = fingerprint(&scan)?;
            Ok(Read::Scan(ReadScan { scan, fingerprint }))
        }
        Ok(None) => Ok(Read::End),
        Err(Error::Stopped) => Ok(Read::Stopped),
        Err(error) if source.pass_unread() => Ok(Read::Unread(error)),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panicked_threads_are_errors() {
        let queue = Arc::new(ScanQueue::new(crate::scan_queue::WhenBehind::Wait, 1));
        let thread_queue = queue.clone();
        let thread = thread::spawn(move || {
            assert!(thread_queue.push(Ok(Read::End)));
            panic!("as a reader of a format might");
        });
        assert!(thread.join().is_err());
        let mut idle = || Ok(());
        assert!(matches!(take(&queue, &Stop::default(), &mut idle), Ok(Read::End)));
        let error = take(&queue, &Stop::default(), &mut idle).err().expect("the queue has no sender");
        assert_eq!(error.to_string(), READER_IS_GONE);
    }
}
