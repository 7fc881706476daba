use crate::args::{LocalArgs, PresetName};
use crate::json;
use crate::local_table::{Row, print_table};
use crate::progress::{Progress, at_terminal};
use crate::read_options::read_options;
use crate::stop_signal;
use std::io::Write;
use std::process::ExitCode;
use voxtile::space::{Grid, Point};
use voxtile::{Error, Scan};
use voxtile_formats::ScanSource;
use voxtile_local::{LocalMap, LocalParameters, LocalReader, LocalState};
use voxtile_pipeline::output::OutputFile;
use voxtile_pipeline::{LocalScans, Watch};
use voxtile_pipeline::{is_standard_input, open_scans};
use voxtile_render::{OverTime, Panel};

/// Times at which the picture shows the map.
const PANELS: usize = 6;

/// One run of the scans through a map.
struct Setup {
    name: &'static str,
    parameters: LocalParameters,
    /// Whether the map hears what another map, which takes the scans, newly finds occupied.
    is_relayed: bool,
}

pub fn run(args: &LocalArgs) -> anyhow::Result<ExitCode> {
    let setups = setups(args);
    if is_standard_input(&args.scans) && (setups.len() > 1 || args.repeat > 1) {
        let reason = "scans from standard input come once: choose one preset and no --repeat, or give a file";
        return Err(Error::argument("SCANS", reason).into());
    }
    // All arguments before the first scan.
    OutputFile::check_picture(&args.output)?;
    for setup in &setups {
        LocalMap::new(args.resolution, setup.parameters)?;
    }
    let input = Input::of(args)?;
    let mut rows = Vec::new();
    for (number, setup) in setups.iter().enumerate() {
        let mut panels = (number == 0).then(Vec::new);
        let mut row = run_setup(args, &input, setup, panels.as_mut())?;
        for _ in 1..args.repeat {
            row.take_least(&run_setup(args, &input, setup, None)?);
        }
        row.finish();
        rows.push(row);
        if let Some(panels) = panels {
            let title = format!("voxtile local: {} m voxels, setup {}", args.resolution, setup.name);
            let image = OverTime { resolution_m: args.resolution, title, panels }.draw();
            let mut file = OutputFile::create(&args.output)?;
            let written = image.write_png(file.out());
            file.written(written)?;
            file.finish()?;
        }
    }
    let mut out = std::io::stdout().lock();
    if args.json {
        for row in &rows {
            json::print(row, &mut out)?;
        }
    } else {
        print_table(&mut out, &rows)?;
        writeln!(out, "picture   {}", args.output.display())?;
    }
    Ok(ExitCode::SUCCESS)
}

fn setups(args: &LocalArgs) -> Vec<Setup> {
    let far = f64::INFINITY;
    let paper = |name, d_in, d_inf, n_lim: Option<usize>| Setup {
        name,
        parameters: LocalParameters::local_mapping().with_ranges(d_in, d_inf).with_max_voxels(n_lim),
        is_relayed: name == "d",
    };
    let preset = |name, parameters| vec![Setup { name, parameters, is_relayed: false }];
    let mut setups = match args.preset {
        PresetName::Local => preset("local", LocalParameters::local_mapping()),
        PresetName::Autonomous => preset("autonomous", LocalParameters::autonomous_mapping()),
        PresetName::Passive => preset("passive", LocalParameters::passive_perception()),
        PresetName::Table => vec![
            paper("a", far, 8.0, Some(50_000)),
            paper("b", far, 8.0, Some(250_000)),
            paper("c", far, 8.0, None),
            paper("d", far, far, Some(50_000)),
            paper("e", 10.0, 8.0, Some(50_000)),
        ],
    };
    for Setup { parameters, .. } in &mut setups {
        if let Some(n_lim) = args.n_lim {
            parameters.max_voxels = (n_lim > 0).then_some(n_lim);
        }
        parameters.input_range_m = args.d_in.unwrap_or(parameters.input_range_m);
        parameters.inflation_range_m = args.d_inf.unwrap_or(parameters.inflation_range_m);
        parameters.inflation_radius_m = args.radius;
        parameters.initial_probability = args.p_init;
        parameters.min_input_range_m = args.min_range;
    }
    setups
}

/// The scans, which all runs read.
struct Input {
    scans: LocalScans,
    watch: Watch,
}

impl Input {
    fn of(args: &LocalArgs) -> anyhow::Result<Self> {
        let watch = at_terminal(stop_signal::catch_if_fetched(&args.scans)?);
        Ok(Self { scans: LocalScans::of(&args.scans, &watch)?, watch })
    }
}

fn run_setup(
    args: &LocalArgs,
    input: &Input,
    setup: &Setup,
    mut panels: Option<&mut Vec<Panel>>,
) -> anyhow::Result<Row> {
    let mut source = open_scans(input.scans.path(), &read_options(&args.read)?, &input.watch)?;
    let scans = source.len_hint();
    let progress = Progress::over_scans(scans);
    let mut map = LocalMap::new(args.resolution, setup.parameters)?;
    let mut relay = match setup.is_relayed {
        true => Some(Relay::new(args, setup)?),
        false => None,
    };
    let mut row = Row::new(setup.name, &setup.parameters);
    let mut path = Vec::new();
    let mut number = 0;
    while let Some(scan) = next_scan(&mut *source, args.points)? {
        input.watch.stop().check()?;
        let relayed = relay.as_mut().map(|relay| relay.points(&scan)).transpose()?;
        let begin = cpu_seconds();
        let report = match relayed {
            Some(points) => map.insert_relayed(scan.origin, &points)?,
            None => map.insert_scan(&scan)?,
        };
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

/// Whether the picture shows the map after so many scans.
fn is_shown(number: usize, scans: Option<usize>) -> bool {
    let Some(scans) = scans else { return false };
    (1..=PANELS).any(|panel| number == (scans * panel).div_ceil(PANELS))
}

/// The next scan, in the world frame, with about so many points.
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

/// Another robot's map, which sends what it newly finds occupied.
struct Relay {
    map: LocalMap,
    reader: LocalReader,
    grid: Grid,
}

impl Relay {
    fn new(args: &LocalArgs, setup: &Setup) -> voxtile::Result<Self> {
        let parameters = setup.parameters.with_ranges(f64::INFINITY, 0.0);
        let map = LocalMap::new(args.resolution, parameters)?;
        let reader = map.reader();
        Ok(Self { reader, grid: Grid::new(args.resolution, 64.0 * args.resolution)?, map })
    }

    /// The centers of the voxels that a scan newly made occupied, in metres.
    fn points(&mut self, scan: &Scan) -> voxtile::Result<Vec<Point>> {
        self.map.insert_scan(scan)?;
        let (_, changes) = self.reader.changes();
        let new = changes.into_iter().filter(|change| change.after == LocalState::Occupied);
        Ok(new.map(|change| self.grid.center_m(change.voxel)).collect())
    }
}

/// Seconds that this thread has worked: on a busy machine the time on the wall says little.
fn cpu_seconds() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}
