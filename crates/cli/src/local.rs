use crate::args::{LocalArgs, PresetName};
use crate::json;
use crate::local_table::Row;
use crate::progress::{Progress, at_terminal};
use crate::read_options::read_options;
use crate::stop_signal;
use std::io::Write;
use std::process::ExitCode;
use voxtile::{Error, Scan};
use voxtile_formats::ScanSource;
use voxtile_local::{LocalMap, LocalParameters};
use voxtile_pipeline::output::OutputFile;
use voxtile_pipeline::{LocalScans, Watch, is_standard_input};
use voxtile_render::{OverTime, Panel};

/// Number of panels in the picture.
const PANELS: usize = 6;

pub fn run(args: &LocalArgs) -> anyhow::Result<ExitCode> {
    if args.scans.iter().any(|scans| is_standard_input(scans)) && args.repeat > 1 {
        let reason = "scans from standard input can be read only once: omit --repeat, or give a file";
        return Err(Error::argument("SCANS", reason).into());
    }
    // Check all arguments before the first scan.
    OutputFile::check_picture(&args.output)?;
    let (preset, parameters) = parameters(args);
    LocalMap::new(args.resolution, parameters)?;
    let input = Input::of(args)?;
    let mut panels = Vec::new();
    let mut row = run_scans(args, &input, Row::new(preset, &parameters), Some(&mut panels))?;
    for _ in 1..args.repeat {
        row.take_minimum(&run_scans(args, &input, Row::new(preset, &parameters), None)?);
    }
    row.finish();
    let title = format!("voxtile local: {} m voxels, setup {preset}", args.resolution);
    let image = OverTime { resolution_m: args.resolution, title, panels }.draw();
    let mut file = OutputFile::create(&args.output)?;
    let written = image.write_png(file.out());
    file.written(written)?;
    file.finish()?;
    let mut out = std::io::stdout().lock();
    if args.json {
        json::print(&row, &mut out)?;
    } else {
        row.print(&mut out)?;
        writeln!(out, "picture   {}", args.output.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Returns the preset's name, and its parameters with the changes from the command line.
fn parameters(args: &LocalArgs) -> (&'static str, LocalParameters) {
    let (name, mut parameters) = match args.preset {
        PresetName::Local => ("local", LocalParameters::local_mapping()),
        PresetName::Autonomous => ("autonomous", LocalParameters::autonomous_mapping()),
        PresetName::Passive => ("passive", LocalParameters::passive_perception()),
    };
    if let Some(n_lim) = args.n_lim {
        parameters.max_voxels = (n_lim > 0).then_some(n_lim);
    }
    parameters.input_range_m = args.d_in.unwrap_or(parameters.input_range_m);
    parameters.inflation_range_m = args.d_inf.unwrap_or(parameters.inflation_range_m);
    parameters.inflation_radius_m = args.radius;
    parameters.initial_probability = args.p_init;
    parameters.min_input_range_m = args.min_range;
    (name, parameters)
}

/// Scans for all runs.
struct Input {
    scans: LocalScans,
    watch: Watch,
}

impl Input {
    fn of(args: &LocalArgs) -> anyhow::Result<Self> {
        let watch = at_terminal(stop_signal::catch_if_fetched(&args.scans)?);
        Ok(Self { scans: LocalScans::of(&args.scans, &read_options(&args.read)?, &watch)?, watch })
    }
}

fn run_scans(
    args: &LocalArgs,
    input: &Input,
    mut row: Row,
    mut panels: Option<&mut Vec<Panel>>,
) -> anyhow::Result<Row> {
    let mut source = input.scans.inputs().open(&read_options(&args.read)?, &input.watch)?;
    let scans = source.len_hint();
    let progress = Progress::over_scans(scans);
    let mut map = LocalMap::new(args.resolution, row.parameters)?;
    let mut path = Vec::new();
    let mut number = 0;
    while let Some(scan) = next_scan(&mut *source, args.points)? {
        input.watch.stop().check()?;
        let begin = cpu_seconds();
        let report = map.insert_scan(&scan)?;
        row.add(&report, cpu_seconds() - begin, &map);
        path.push(scan.origin);
        number += 1;
        if let Some(panels) = panels.as_mut()
            && is_shown(number, scans)
        {
            panels.push(Panel::of(map.view(), number, path.clone()));
        }
        progress.step();
    }
    if let Some(panels) = panels.filter(|panels| panels.is_empty()) {
        panels.push(Panel::of(map.view(), number, path));
    }
    row.count_memory(&map);
    Ok(row)
}

/// Returns whether the picture has a panel after this number of scans.
fn is_shown(number: usize, scans: Option<usize>) -> bool {
    let Some(scans) = scans else { return false };
    (1..=PANELS).any(|panel| number == (scans * panel).div_ceil(PANELS))
}

/// Returns the next scan in the world frame, with about `points` points.
fn next_scan(source: &mut dyn ScanSource, points: Option<u32>) -> voxtile::Result<Option<Scan>> {
    let Some(scan) = source.next_scan()? else { return Ok(None) };
    let mut scan = scan.into_scan();
    if let Some(most) = points.map(|points| points as usize).filter(|&most| most < scan.points.len()) {
        let all = scan.points.len();
        scan.points = (0..most).map(|k| scan.points[k * all / most]).collect();
        scan.intensities = None;
    }
    Ok(Some(scan))
}

/// Returns the processor time of this thread in seconds; the wall clock depends on other programs.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
