use crate::build_config::{config_to_create, config_to_go_on};
use crate::build_options::BuildOptions;
use crate::failed_flush::FailedFlush;
use crate::flush_schedule::FlushSchedule;
use crate::ingest::{Ingest, Next, RayNeeds, Taken};
use crate::layer_check::LayerCheck;
use crate::pose_check::{Doubt, PoseCheck, check_ahead};
use crate::scan_input::{ScanInput, ScanInputs, is_standard_input};
use crate::scan_queue::{ScanQueue, WhenBehind};
use crate::scan_reader::{FingerprintFn, ScanReader};
use crate::summary::Summary;
use crate::watch::{Gauge, Watch};
use crate::whole_map;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use voxtile::beginning_or_difference;
use voxtile::mapper::{MapReader, MapView, Mapper, OutOfCoreTileMapper};
use voxtile::scan::{AttributeSet, ScanPoints, ScanReport};
use voxtile::store::{FsDisk, InputContent, InputRecord, UnsyncedDisk};
use voxtile::{Error, MapConfig, MapPath, MemoryLimit};
use voxtile_formats::{PointBudget, ReadOptions, ScanFingerprint};

/// Divisor of the memory limit that gives the share for reading, without the points of scans: chunks and messages of
/// recordings, poses, sorting of LAS files.
const PARTS_FOR_READING: usize = 32;
/// Minimum memory for reading. If it exceeds the share, the difference is taken from the map's memory.
const MIN_FOR_READING: usize = 4 << 20;

/// Divisor of the memory limit that gives the share for the points of scans that are being read or inserted.
const PARTS_OF_MEMORY: usize = 32;

/// Minimum memory per scan for inserting several scans at once: the points of a lidar with 128 beams.
const MIN_BATCH_BYTES: usize = 3 << 20;

/// Builds or continues a map. Returns `None` if it was stopped before the first scan. All accepted scans are flushed,
/// however the build ends.
///
/// # Errors
///
/// The options do not fit the map or the input, or an input or a map cannot be read or written.
pub fn build(options: &BuildOptions, watch: &Watch) -> anyhow::Result<Option<Summary>> {
    let started = Instant::now();
    check_combinations(options)?;
    let inputs = ScanInputs::of(&options.scans, &options.read, watch.stop())?;
    inputs.remarks().iter().for_each(|remark| log::warn!("{remark}"));
    let mut options = options.clone();
    if inputs.inputs().len() > 1 {
        check_several(&options)?;
        options.read.clouds.are_poses_shared = true;
        options.read.selection = options.read.selection.across_inputs();
    }
    let mut all: Option<Summary> = None;
    for input in inputs.inputs() {
        if all.is_some() && options.read.selection.is_complete() {
            break;
        }
        let scans = all.as_ref().map_or(0, |all| all.resumed_after + all.scans);
        let built = build_input(&options, input, scans, watch).map_err(|error| match scans {
            0 => error,
            _ => error.context(format!("{scans} scans of the inputs before {input} are in the map")),
        })?;
        let Some(built) = built else {
            all.iter_mut().for_each(|all| all.interrupted = true);
            break;
        };
        let summary = match all.take() {
            None => built,
            Some(earlier) => built.after(earlier),
        };
        let is_stopped = summary.interrupted;
        all = Some(summary);
        if is_stopped {
            break;
        }
        // The map exists now; the next input is another one.
        options.append = true;
    }
    Ok(all.map(|mut all| {
        all.remarks.splice(0..0, inputs.remarks().iter().cloned());
        all.seconds = started.elapsed().as_secs_f64();
        all
    }))
}

/// Builds or continues a map with the scans of one input. `scans_before` is the number of scans of the inputs before it.
fn build_input(
    options: &BuildOptions,
    scans: &ScanInput,
    scans_before: u64,
    watch: &Watch,
) -> anyhow::Result<Option<Summary>> {
    let started = Instant::now();
    let stop = watch.stop();
    let exists = exists(options)?;
    let config = if exists { config_to_go_on(options, scans)? } else { config_to_create(options)? };
    check_no_rays(options, &config)?;
    check_when_behind(options, scans)?;
    // A shard is never resumed or compared, so its scans are not hashed.
    let fingerprint: FingerprintFn = if options.piece_of.is_none() {
        ScanFingerprint::of
    } else {
        |scan| Ok(ScanFingerprint::without_content(scan))
    };
    let point_budget = point_budget(options, &config);
    let max_batch = max_batch(options, &config);
    let read = read_options(options, &config);
    let is_checked = options.strict && check_ahead(scans, &read, &point_budget, watch)?;
    let opened = ScanReader::open(scans.clone(), read.clone(), point_budget, fingerprint, watch.clone())?;
    let Some((reader, input)) = opened else { return Ok(None) };
    let pose_check = if is_checked { None } else { PoseCheck::of(&read, &input.poses, scans.first()) };
    let config = config_of_map(scans, &config);
    let needs = RayNeeds { grid: config.grid, sensor_model: config.sensor_model };
    let mut ingest =
        Ingest::new(reader, scans.clone(), options.skip_bad, (!options.no_rays).then_some(needs));
    let mut opened_map = match exists {
        true => Some(open_map(options, &config)?),
        false => None,
    };
    if !ingest.read_lookahead()? {
        return Ok(None);
    }
    let crs = ingest.crs();
    let mapper = match &mut opened_map {
        Some(mapper) => {
            check_crs(scans, crs.as_ref(), config.crs.as_ref())?;
            mapper
        }
        none => {
            // Check before the map is created: if the first scan cannot be mapped, no empty map may remain.
            ingest.check_first()?;
            let mut config = config;
            config.crs = crs;
            whole_map(&options.output)?;
            none.insert(match options.piece_of {
                None => OutOfCoreTileMapper::create(&options.output, config)?,
                Some(map_id) => OutOfCoreTileMapper::create_as(map_path(options), config, map_id)?,
            })
        }
    };
    mapper.stop_with(stop.clone());
    let Some(resumed_after) = begin(options, scans, mapper, &mut ingest, &input.name)? else {
        return Ok(None);
    };

    if options.piece_of.is_some() && mapper.config().keeps_scans {
        // A shard numbers the scans of the whole build.
        let before = options.scans_before.saturating_add(options.read.selection.first);
        mapper.skip_scans(before.saturating_sub(mapper.scan_number()));
    }
    if options.when_behind != WhenBehind::Wait {
        ingest.read_ahead(ScanQueue::new(options.when_behind, ScanQueue::MAX_SCANS));
    } else if max_batch > 1 {
        ingest.read_ahead(ScanQueue::new(options.when_behind, max_batch));
    }
    let gauge = watch.over_scans(input.scans.map(|scans| scans + scans_before as usize));
    gauge.pass(scans_before + ingest.content().scans);
    let layer_check = LayerCheck::new(mapper.config().layers());
    let mut build = Build {
        mapper,
        ingest,
        schedule: FlushSchedule::new(options.flush_every),
        gauge,
        report: ScanReport::default(),
        scans: 0,
        has_rays: !options.no_rays,
        max_batch,
        notes_content: options.piece_of.is_none(),
        pose_check,
        doubt: None,
        is_strict: options.strict,
        layer_check,
    };
    let outcome = build.insert_all();
    build.gauge.say("flushing");
    // Accepted scans are flushed, however the build ended.
    let flushed = build.mapper.flush();
    let Build { report, scans, mut ingest, gauge, doubt, layer_check, .. } = build;
    drop(gauge);
    let mut remarks = ingest.remarks();
    remarks.iter_mut().for_each(|remark| *remark = format!("{scans}: {remark}"));
    remarks.extend(doubt.map(|doubt| doubt.remark()));
    remarks.extend(all_rays_cut(&report, mapper.config()));
    remarks.extend(layer_check.remarks());
    remarks.iter().for_each(|remark| log::warn!("{remark}"));
    if let Err(flush_error) = flushed {
        let (config, scan_number) = (mapper.config().clone(), mapper.flushed_scan_number());
        let (is_new, is_shard) = (!exists, options.piece_of.is_some());
        let failed = FailedFlush { folder: &options.output, config, scan_number, is_new, is_shard };
        drop(opened_map);
        let flush_error = failed.clean(flush_error);
        return Err(match outcome {
            Ok(()) => flush_error,
            Err(error) => error.context(format!("{flush_error:#}; the previous error")),
        });
    }
    if let Err(error) = outcome {
        let all = resumed_after + scans;
        let mapped = if all == 1 { "1 scan".to_owned() } else { format!("{all} scans") };
        return Err(error.context(format!("after {mapped}, already in the map")));
    }
    let interrupted = stop.is_set();
    let summary = Summary::of(&options.output, scans, report, mapper, started.elapsed())?;
    let (poses, unread, left_out) = (Some(input.poses.to_string()), ingest.unread, ingest.left_out);
    Ok(Some(Summary { interrupted, resumed_after, poses, unread, left_out, remarks, ..summary }))
}

struct Build<'a> {
    mapper: &'a mut OutOfCoreTileMapper,
    ingest: Ingest,
    schedule: FlushSchedule,
    gauge: Box<dyn Gauge>,
    report: ScanReport,
    scans: u64,
    has_rays: bool,
    /// Maximum number of scans to insert at once.
    max_batch: usize,
    notes_content: bool,
    /// Check of the poses, until its result is known.
    pose_check: Option<PoseCheck>,
    doubt: Option<Doubt>,
    is_strict: bool,
    layer_check: LayerCheck,
}

impl Build<'_> {
    fn insert_all(&mut self) -> anyhow::Result<()> {
        loop {
            let (mapper, schedule) = (&mut *self.mapper, &mut self.schedule);
            let most = self.max_batch.min(schedule.scans_until_due());
            // While the input is idle, pending scans are still flushed on schedule.
            let next =
                self.ingest.next(most, &mut || flush_if(schedule.is_due_waiting(), mapper, schedule))?;
            let taken = match next {
                Next::Scans(taken) => taken,
                Next::Stopped => return Ok(()),
                Next::End => {
                    // The last scans may have been skipped after the last insertion, so record the state of the input
                    // again.
                    self.note_content(self.ingest.content());
                    self.check_poses(PoseCheck::finish)?;
                    return Ok(());
                }
            };
            for Taken { scan, .. } in &taken {
                self.check_poses(|check| check.take(scan))?;
                self.layer_check.note(scan)?;
            }
            let mut reports = Vec::with_capacity(taken.len());
            let inserted = self.insert(&taken, &mut reports);
            for report in &reports {
                self.report += *report;
                self.scans += 1;
                self.gauge.step();
                self.gauge.show(&|| self.mapper.statistics());
            }
            if let Some(last) = reports.len().checked_sub(1) {
                self.note_content(taken[last].content.clone());
            }
            match inserted {
                Ok(()) => {}
                Err(Error::Stopped) => return Ok(()),
                Err(error) => return Err(error.into()),
            }
            flush_if(self.schedule.is_due(reports.len()), self.mapper, &mut self.schedule)?;
        }
    }

    fn insert(&mut self, taken: &[Taken], reports: &mut Vec<ScanReport>) -> voxtile::Result<()> {
        if self.has_rays {
            let scans: Vec<&dyn ScanPoints> = taken.iter().map(|taken| &taken.scan as _).collect();
            return self.mapper.insert_all(&scans, reports);
        }
        for Taken { scan, .. } in taken {
            reports.push(self.mapper.insert_hits(scan)?);
        }
        Ok(())
    }

    /// Compares a scan with the previous ones. A failed comparison does not end the build.
    fn check_poses(
        &mut self,
        look: impl FnOnce(&mut PoseCheck) -> voxtile::Result<Option<Doubt>>,
    ) -> voxtile::Result<()> {
        let Some(check) = &mut self.pose_check else { return Ok(()) };
        match look(check) {
            Ok(Some(doubt)) if self.is_strict => return Err(doubt.refusal()),
            Ok(Some(doubt)) => self.doubt = Some(doubt),
            Ok(None) if !check.is_done() => return Ok(()),
            Ok(None) => {}
            Err(error) => log::debug!("poses are not compared: {error}"),
        }
        self.pose_check = None;
        Ok(())
    }

    fn note_content(&mut self, content: InputContent) {
        if self.notes_content {
            self.mapper.note_input_content(content);
        }
    }
}

/// Returns the settings for reading. Poses are not needed without rays.
fn read_options(options: &BuildOptions, config: &MapConfig) -> ReadOptions {
    let mut read = options.read.clone();
    read.scratch = Some(scratch_folder(options).to_owned());
    if let Some(bytes) = config.memory_bytes() {
        read.memory_bytes = for_reading(bytes);
    }
    let layers = config.layers();
    read.attributes = AttributeSet { colours: layers.colour, classes: layers.class, ..AttributeSet::NONE };
    read.clouds.has_no_returns = config.rays.no_return_range_m.is_some();
    if options.no_rays && read.poses.is_none() {
        read.clouds.may_lack_poses = true;
        read.clouds.are_poses_needed = false;
    }
    read
}

/// Checks that `no_rays` is not combined with kept scans, because points without rays cannot be replayed.
fn check_no_rays(options: &BuildOptions, config: &MapConfig) -> voxtile::Result<()> {
    if !(options.no_rays && config.keeps_scans) {
        return Ok(());
    }
    let reason =
        "points without rays cannot be kept as scans: omit one of the two options, or build another map";
    Err(Error::argument("no_rays, keep_scans", reason))
}

/// Checks options that require or exclude other options.
fn check_combinations(options: &BuildOptions) -> voxtile::Result<()> {
    if options.again && (options.resume || !options.append) {
        return Err(Error::argument("again", "requires `append`, and excludes `resume`"));
    }
    if options.read.calib.is_some() && options.read.poses.is_none() {
        return Err(Error::argument("calib", "requires a pose file: add `poses`"));
    }
    Ok(())
}

/// Checks options that exclude several inputs.
fn check_several(options: &BuildOptions) -> voxtile::Result<()> {
    if options.piece_of.is_some() {
        return Err(Error::argument("scans", "a shard is built from one input"));
    }
    Ok(())
}

/// Checks that the input is a stream, because only streams can be faster than the mapper.
fn check_when_behind(options: &BuildOptions, scans: &ScanInput) -> voxtile::Result<()> {
    if options.when_behind == WhenBehind::Wait || !scans.is_on_disk() {
        return Ok(());
    }
    let reason = "has no effect on files: omit it, or read a live stream from - or a pipe";
    Err(Error::argument("when_behind", reason))
}

fn flush_if(
    is_due: bool,
    mapper: &mut OutOfCoreTileMapper,
    schedule: &mut FlushSchedule,
) -> voxtile::Result<()> {
    if !is_due {
        return Ok(());
    }
    if !schedule.is_by_time() {
        mapper.flush()?;
    } else if mapper.is_flushing() {
        // The disk is slower than the schedule: the next flush begins after the current one.
        return Ok(());
    } else {
        // Start the flush in the background; further scans are inserted meanwhile.
        mapper.begin_flush()?;
    }
    schedule.flushed();
    Ok(())
}

/// Returns the path of the map. A shard is not durable until it is imported; after a crash it is built again.
fn map_path(options: &BuildOptions) -> MapPath {
    match options.piece_of {
        None => MapPath::from(&options.output),
        Some(_) => MapPath::on(Arc::new(UnsyncedDisk::of(Arc::new(FsDisk))), &options.output),
    }
}

/// Returns whether there is a map to continue.
fn exists(options: &BuildOptions) -> anyhow::Result<bool> {
    if options.output.is_file() {
        let reason = "is a file, but a map is a folder: choose another `output`";
        return Err(Error::argument(options.output.display().to_string(), reason).into());
    }
    let exists = match MapReader::open(&options.output, 0) {
        Err(Error::NoMap { .. }) => false,
        // Damage is reported by the mapper, which opens the map next.
        _ => true,
    };
    if exists && !options.append && !options.resume {
        let hint = "use `resume` to continue with these scans, `append` to add them, or another `output`";
        return Err(Error::AlreadyExists { path: options.output.clone(), hint }.into());
    }
    if !exists && options.append && !options.resume {
        return Err(Error::NoMap { path: options.output.clone() }.into());
    }
    Ok(exists)
}

/// Resumes an input of which the map has scans, or begins a new one. Returns the number of its scans that the map has,
/// or `None` if the build was stopped.
fn begin(
    options: &BuildOptions,
    scans: &ScanInput,
    mapper: &mut OutOfCoreTileMapper,
    ingest: &mut Ingest,
    name: &str,
) -> anyhow::Result<Option<u64>> {
    let inputs = mapper.inputs();
    // Inputs that begin with many empty scans may have the same content so far. Such inputs are distinguished by later
    // scans or by their names.
    let is_this = |input: &InputRecord| {
        let is_known = |content: &InputContent| content.begins_with.is_some() || input.is_named(name);
        let is_same = |content: &InputContent| {
            content.begins_with.as_deref() == ingest.begins_with()
                || (is_known(content) && ingest.begins_as(content))
        };
        input.content.as_ref().is_some_and(is_same)
    };
    if let Some(at) = inputs.iter().rposition(is_this).filter(|_| !options.again) {
        let content = inputs[at].content.clone().unwrap_or_default();
        if options.resume {
            if !ingest.pass_over(&content)? {
                return Ok(None);
            }
            check_begun(options, &inputs[at], mapper)?;
            if at + 1 < inputs.len() {
                // The map has later inputs, so make this one the current input again.
                mapper.begin_input(inputs[at].clone())?;
            }
            return Ok(Some(content.scans - content.skipped.len() as u64));
        }
        if content.scans > 0 {
            return Err(taken_before(scans, &inputs[at].name, content.scans));
        }
    }
    if let Some(last) = inputs.last().filter(|last| last.content.is_none() && !options.again) {
        // A map of an older version identifies the whole input by a fingerprint.
        let Some(fingerprint) = ingest.fingerprint()? else { return Ok(None) };
        if fingerprint.is_ok_and(|fingerprint| fingerprint == last.name) {
            let done = mapper.scan_number().saturating_sub(last.first_scan);
            if !options.resume {
                return Err(taken_before(scans, name, done));
            }
            check_begun(options, last, mapper)?;
            return Ok(ingest.pass(done)?.then_some(done));
        }
    }
    // A merged map is not empty, although its scan count is 0.
    let is_empty = mapper.scan_number() == 0 && mapper.tile_bounds().is_none();
    if options.resume && !options.append && !is_empty {
        let same = inputs.iter().rfind(|input| input.is_named(name) && input.content.is_some());
        let (found, wanted) = match same.or(inputs.last()) {
            None => ("of unknown origin".to_owned(), name.to_owned()),
            Some(known) => match known.content {
                // The recorded name is a fingerprint.
                None => {
                    let Some(fingerprint) = ingest.fingerprint()? else { return Ok(None) };
                    (known.name.clone(), fingerprint.map_or(name.to_owned(), |of| format!("{of} ({name})")))
                }
                Some(_) if known.is_named(name) => (
                    beginning(&known.name, known.begins_with()),
                    format!(
                        "{}: the input was replaced or its beginning has changed",
                        beginning(name, ingest.begins_with())
                    ),
                ),
                Some(_) => (known.name.clone(), name.to_owned()),
            },
        };
        let (path, what) = (options.output.clone(), "been built from input");
        let error = anyhow::Error::from(Error::Mismatch { path, what, found, wanted });
        return Err(error
            .context("`resume` continues an input that the map already has; `append` adds another input"));
    }
    let content = options.piece_of.is_none().then(|| ingest.content());
    let (rays, is_hits_alone) = (Some(mapper.config().rays), Some(options.no_rays));
    mapper.begin_input(InputRecord { content, rays, is_hits_alone, ..InputRecord::from(name) })?;
    Ok(Some(0))
}

/// Describes an input by its name and its content.
fn beginning(name: &str, begins_with: Option<&str>) -> String {
    match begins_with {
        Some(fingerprint) => {
            format!("{name} whose first scan with points has the fingerprint {fingerprint:.12}")
        }
        None => format!("{name} without points in its first scans"),
    }
}

/// Checks that an input continues with its original settings.
fn check_begun(
    options: &BuildOptions,
    input: &InputRecord,
    mapper: &OutOfCoreTileMapper,
) -> voxtile::Result<()> {
    match input.is_hits_alone {
        Some(begun) if begun != options.no_rays => {
            let how = |is_hits_alone| if is_hits_alone { "points without rays (`no_rays`)" } else { "rays" };
            let (found, wanted) = (how(begun).to_owned(), how(options.no_rays).to_owned());
            let what = "been built from this input with";
            Err(Error::Mismatch { path: options.output.clone(), what, found, wanted })
        }
        _ => mapper.check_rays(input),
    }
}

/// Opens the map to extend.
fn open_map(options: &BuildOptions, config: &MapConfig) -> anyhow::Result<OutOfCoreTileMapper> {
    OutOfCoreTileMapper::open(map_path(options), config.clone()).map_err(|error| match error {
        Error::Mismatch { what: "layers", .. } => anyhow::Error::from(error).context(
            "a map has its layers from its creation on; `voxtile remap MAP -o NEW` with `layers` makes another one of \
             the scans that it keeps",
        ),
        other => other.into(),
    })
}

/// Checks that the coordinate reference systems of input and map agree.
fn check_crs(scans: &ScanInput, found: Option<&String>, own: Option<&String>) -> voxtile::Result<()> {
    match (found, own) {
        (Some(found), Some(own)) if found != own => {
            let reason = format!(
                "its coordinates are in {}, but the map is in {}: convert them first, for instance with pdal",
                beginning_or_difference(found, own),
                beginning_or_difference(own, found)
            );
            Err(Error::argument(scans.to_string(), reason))
        }
        _ => Ok(()),
    }
}

fn taken_before(input: &ScanInput, name: &str, scans: u64) -> anyhow::Error {
    let reason = format!(
        "the map already has {scans} scans of an input with the same beginning ({name}); use `resume` to add the later \
         scans, or `append` `again` to add all scans again"
    );
    Error::argument(input.to_string(), reason).into()
}

/// Returns the folder for temporary files: the map's folder, or its nearest existing ancestor. The system's temporary
/// folder may be in memory.
fn scratch_folder(options: &BuildOptions) -> &Path {
    options.output.ancestors().find(|folder| folder.is_dir()).unwrap_or(Path::new("."))
}

/// Returns the memory for reading, given the memory limit.
fn for_reading(bytes: usize) -> usize {
    (bytes / PARTS_FOR_READING).max(MIN_FOR_READING)
}

/// Returns the configuration of the map with its memory reduced by the share for reading.
fn config_of_map(scans: &ScanInput, config: &MapConfig) -> MapConfig {
    let mut config = config.clone();
    if let Some(bytes) = config.memory_bytes()
        && !is_standard_input(scans.first())
    {
        let least = MemoryLimit::min_bytes(&config.grid).min(bytes);
        config.memory = MemoryLimit::Bytes((bytes - (for_reading(bytes) - MIN_FOR_READING)).max(least));
    }
    config
}

/// Returns the memory limit for the points of a scan. Further points go to a file.
fn point_budget(options: &BuildOptions, config: &MapConfig) -> PointBudget {
    let folder = scratch_folder(options);
    match config.memory_bytes() {
        Some(bytes) => PointBudget::new(bytes / PARTS_OF_MEMORY / scans_in_memory(options, config), folder),
        None => PointBudget::default(),
    }
}

/// Returns the number of scans that can exist at once: being inserted, queued, and being read.
fn scans_in_memory(options: &BuildOptions, config: &MapConfig) -> usize {
    let together = max_batch(options, config);
    match options.when_behind {
        WhenBehind::Wait if together == 1 => 1,
        WhenBehind::Wait => 2 * together + 1,
        _ => together + ScanQueue::MAX_SCANS + 1,
    }
}

/// Returns the maximum number of scans to insert at once: one per core, limited by the memory for their points.
fn max_batch(options: &BuildOptions, config: &MapConfig) -> usize {
    let point_budget =
        config.memory_bytes().map_or(usize::MAX, |bytes| bytes / PARTS_OF_MEMORY / MIN_BATCH_BYTES);
    if options.no_rays {
        1
    } else {
        rayon::current_num_threads().min(point_budget.saturating_sub(1) / 2).max(1)
    }
}

/// Returns a warning if all rays were cut, which leaves only free space.
fn all_rays_cut(report: &ScanReport, config: &MapConfig) -> Option<String> {
    let ScanReport { points, skipped, cut_at_max_range, .. } = *report;
    let skipped: u64 = skipped.by_cause().into_iter().map(|(_, count)| count).sum();
    let range_m = config.rays.max_range_m?;
    (cut_at_max_range > 0 && cut_at_max_range + skipped == points).then(|| {
        format!(
            "all {cut_at_max_range} rays were cut at {range_m} m, so nothing is occupied: raise `max_range`, or check \
             that the points are in metres. Points already in the world frame, far from 0 0 0, need `world_frame` with \
             poses, `sensor_origin` or `no_rays`"
        )
    })
}
