use super::svg::{Bar, histogram};
use super::{Content, Damage, MAX_FINDINGS, Report, Sizes};
use crate::counted::Counted;
use crate::html::{
    Text, begin_page, begin_table, end_page, end_table, number_cell, rounded, row, write_picture,
};
use indicatif::{HumanBytes, HumanCount};
use std::io::{self, Write};
use voxtile::store::ScanRecord;
use voxtile_render::classes::class_label;
use voxtile_render::{ColorMap, Survey, colors};

const SECONDS_A_NS: f64 = 1e-9;

impl Report {
    /// Writes the page.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let line = format!("A map of voxtile {}", env!("CARGO_PKG_VERSION"));
        begin_page(out, &format!("{}: map report", self.name), &self.name, &line)?;
        self.write_state(out)?;
        if let Some(content) = &self.content {
            content.write(out)?;
        }
        self.write_snapshots(out)?;
        self.write_findings(out)?;
        end_page(out)
    }

    /// Writes one line on the state of the files.
    fn write_state(&self, out: &mut impl Write) -> io::Result<()> {
        if let Some(reason) = &self.unreadable {
            writeln!(out, "<p class=\"bad\">The map cannot be read: {}</p>", Text(reason))?;
        }
        match &self.damage {
            Damage::NotVerified => writeln!(out, "<p class=\"faint\">The files were not verified.</p>"),
            Damage::OfSnapshot => {
                writeln!(out, "<p class=\"faint\">A snapshot is verified with its map.</p>")
            }
            Damage::Failed(reason) => {
                writeln!(out, "<p class=\"bad\">Verifying failed: {}</p>", Text(reason))
            }
            Damage::Checked { verification, .. } => match (verification.damage, verification.verified) {
                (0, true) => writeln!(out, "<p class=\"good\">Intact: all checksums match.</p>"),
                (0, false) => writeln!(out, "<p>Unverified: the map has no checksums.</p>"),
                (count, _) => {
                    writeln!(out, "<p class=\"bad\">Damaged: {}, see below.</p>", Counted(count, "finding"))
                }
            },
        }
    }

    fn write_snapshots(&self, out: &mut impl Write) -> io::Result<()> {
        let snapshots = match &self.snapshots {
            Ok(snapshots) if snapshots.is_empty() => return Ok(()),
            Ok(snapshots) => snapshots,
            Err(reason) => {
                return writeln!(out, "<h2>Snapshots</h2>\n<p class=\"bad\">{}</p>", Text(reason));
            }
        };
        begin_table(out, "Snapshots", &["name", "#scan", "#tiles", "#voxels", "#its own bytes"])?;
        for snapshot in snapshots {
            write!(out, "<tr><td>{}</td>", Text(&snapshot.name))?;
            match &snapshot.damage {
                Some(damage) => write!(out, "<td colspan=\"4\" class=\"bad\">{}</td>", Text(damage))?,
                None => {
                    for number in [snapshot.scan_number, snapshot.tiles, snapshot.voxels] {
                        number_cell(out, HumanCount(number))?;
                    }
                    number_cell(out, HumanBytes(snapshot.own_bytes))?;
                }
            }
            writeln!(out, "</tr>")?;
        }
        end_table(out)
    }

    fn write_findings(&self, out: &mut impl Write) -> io::Result<()> {
        let Damage::Checked { verification, findings } = &self.damage else { return Ok(()) };
        if findings.is_empty() {
            return Ok(());
        }
        begin_table(out, "Findings", &["file", "tile", "#offset", "what"])?;
        for finding in findings {
            let tile = finding.tile.map_or(String::new(), |[x, y, z]| format!("{x} {y} {z}"));
            let offset = finding.offset.map_or(String::new(), |offset| offset.to_string());
            let path = Text(finding.path.display());
            write!(out, "<tr><td>{path}</td><td>{tile}</td>")?;
            number_cell(out, offset)?;
            writeln!(out, "<td>{}</td></tr>", Text(&finding.reason))?;
        }
        end_table(out)?;
        let more = (verification.damage + verification.notes).saturating_sub(MAX_FINDINGS as u64);
        if more > 0 {
            let more = HumanCount(more);
            writeln!(out, "<p class=\"faint\">{more} more; <code>voxtile verify</code> lists all.</p>")?;
        }
        Ok(())
    }
}

impl Content {
    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let Self { info, survey, .. } = self;
        let share = survey.occupied as f64 / survey.voxels.max(1) as f64;
        writeln!(out, "<div class=\"big\">")?;
        for (value, name) in [
            (format!("{} m", info.resolution_m), "voxels of"),
            (HumanCount(info.tiles).to_string(), "tiles"),
            (area(survey.area_m2), "observed from above"),
            (format!("{} m³", rounded(survey.volume_m3)), "observed"),
            (format!("{:.1} %", 100.0 * share), "of the voxels occupied"),
            (HumanCount(info.scan_number).to_string(), "scans"),
        ] {
            writeln!(out, "<div><b>{value}</b><span class=\"faint\">{name}</span></div>")?;
        }
        writeln!(out, "</div>")?;
        write_picture(
            out,
            &self.above,
            &format!(
                "From above{}: each column in the color of its topmost occupied voxel.",
                self.ceiling.remark()
            ),
        )?;
        for (drawn, caption) in &self.layers {
            write_picture(out, drawn, caption)?;
        }
        write_picture(out, &self.side, "From the side.")?;
        self.write_numbers(out)?;
        write_classes(out, survey)?;
        write_histograms(out, survey, self.color_map)?;
        self.sizes.write(out)
    }

    fn write_numbers(&self, out: &mut impl Write) -> io::Result<()> {
        let Self { info, survey, .. } = self;
        begin_table(out, "Numbers", &[])?;
        row(out, "map id", Text(info.map_id.as_deref().unwrap_or("none: the original format")))?;
        row(out, "resolution", format!("{} m", info.resolution_m))?;
        row(out, "tile size", format!("{} m", info.tile_size_m))?;
        row(out, "occupied from", format!("probability {}", info.occupancy_threshold))?;
        row(out, "storage", Text(format!("{:?}", info.storage)))?;
        row(out, "tiles", HumanCount(info.tiles))?;
        if let Some(bounds) = info.bounds_m {
            row(out, "lower corner", format!("{:?} m", bounds.min))?;
            row(out, "upper corner", format!("{:?} m", bounds.max))?;
        }
        row(out, "voxels", HumanCount(info.voxels))?;
        row(out, "occupied", HumanCount(info.occupied))?;
        row(out, "columns observed", HumanCount(survey.columns))?;
        row(out, "columns occupied", HumanCount(survey.occupied_columns))?;
        row(out, "area observed", format!("{} m²", rounded(survey.area_m2)))?;
        row(out, "volume observed", format!("{} m³", rounded(survey.volume_m3)))?;
        row(out, "bytes of tables", HumanCount(info.table_bytes))?;
        row(out, "bytes of octrees", HumanCount(info.octree_bytes))?;
        row(out, "flushes", HumanCount(info.flush_number))?;
        row(out, "scans", HumanCount(info.scan_number))?;
        match &self.scans {
            Ok(scans) => write_scans(out, scans)?,
            Err(reason) => row(out, "list of scans", Text(reason))?,
        }
        for input in &info.inputs {
            row(out, &format!("input from scan {}", HumanCount(input.first_scan)), Text(&input.name))?;
        }
        end_table(out)?;
        if !survey.unread.is_empty() {
            let tiles = Counted(survey.unread.len() as u64, "tile");
            writeln!(
                out,
                "<p class=\"bad\">{tiles} cannot be read. Pictures, columns and histograms lack them.</p>"
            )?;
        }
        Ok(())
    }
}

/// Writes the occupied voxels by class.
fn write_classes(out: &mut impl Write, survey: &Survey) -> io::Result<()> {
    if survey.classes.is_empty() {
        return Ok(());
    }
    begin_table(out, "Classes of occupied voxels", &["class", "#voxels", "#share"])?;
    let without = survey.occupied - survey.classes.values().sum::<u64>();
    let classes = survey.classes.iter().map(|(class, count)| (class_label(*class), *count));
    for (label, count) in classes.chain((without > 0).then(|| ("no class".to_owned(), without))) {
        write!(out, "<tr><td>{label}</td>")?;
        number_cell(out, HumanCount(count))?;
        number_cell(out, format!("{:.1} %", 100.0 * count as f64 / survey.occupied as f64))?;
        writeln!(out, "</tr>")?;
    }
    end_table(out)
}

fn write_scans(out: &mut impl Write, scans: &[ScanRecord]) -> io::Result<()> {
    let (Some(first), Some(last)) = (scans.first(), scans.last()) else { return Ok(()) };
    row(out, "scans listed", HumanCount(scans.len() as u64))?;
    let step_m = |pair: &[ScanRecord]| {
        let squares = (0..3).map(|k| (pair[1].origin_m[k] - pair[0].origin_m[k]).powi(2));
        squares.sum::<f64>().sqrt()
    };
    let length_m: f64 = scans.windows(2).map(step_m).sum();
    row(out, "trajectory", format!("{} m", rounded(length_m)))?;
    if let (Some(from_ns), Some(to_ns)) = (first.stamp_ns, last.stamp_ns) {
        let seconds = (to_ns as f64 - from_ns as f64) * SECONDS_A_NS;
        row(out, "time span", format!("{seconds:.1} s"))?;
        let stamps = [from_ns, to_ns].map(|ns| format!("{:.3} s", ns as f64 * SECONDS_A_NS));
        row(out, "time stamps", stamps.join(" to "))?;
    }
    Ok(())
}

fn write_histograms(out: &mut impl Write, survey: &Survey, color_map: &ColorMap) -> io::Result<()> {
    let bins = survey.probabilities.len();
    let bars: Vec<Bar> = (0..bins)
        .map(|bin| {
            let border = |bin: usize| bin as f64 / bins as f64;
            Bar {
                from: format!("{:.2}", border(bin)),
                to: format!("{:.2}", border(bin + 1)),
                count: survey.probabilities[bin],
                color: if bin < bins / 2 {
                    [118, 134, 158]
                } else {
                    colors::color_of(border(bin) * 2.0 - 1.0)
                },
            }
        })
        .collect();
    write_histogram(out, "Observed voxels by probability of being occupied", &bars)?;
    let most = survey.heights.len().max(2) - 1;
    let bars: Vec<Bar> = survey
        .heights
        .iter()
        .enumerate()
        .map(|(number, bin)| Bar {
            from: format!("{} m", hundredths(bin.from_m)),
            to: format!("{} m", hundredths(bin.to_m)),
            count: bin.occupied,
            color: color_map.color_of(number as f64 / most as f64),
        })
        .collect();
    if bars.is_empty() { Ok(()) } else { write_histogram(out, "Occupied voxels by height", &bars) }
}

fn write_histogram(out: &mut impl Write, what: &str, bars: &[Bar]) -> io::Result<()> {
    let svg = histogram(bars, what).map_err(io::Error::other)?;
    writeln!(out, "<h2>{what}</h2>\n<figure>{svg}</figure>")
}

impl Sizes {
    fn write(&self, out: &mut impl Write) -> io::Result<()> {
        if self.bytes.is_empty() {
            return Ok(());
        }
        let (all, count) = (self.bytes.iter().sum::<u64>(), self.bytes.len());
        begin_table(out, "Tiles by size", &["tile", "#bytes", "#voxels"])?;
        for (tile, bytes, voxels) in &self.largest {
            let [x, y, z] = tile.to_array();
            write!(out, "<tr><td>{x} {y} {z}</td>")?;
            number_cell(out, HumanCount(*bytes))?;
            number_cell(out, voxels.map_or(String::new(), |voxels| HumanCount(voxels).to_string()))?;
            writeln!(out, "</tr>")?;
        }
        end_table(out)?;
        writeln!(
            out,
            "<p class=\"faint\">The largest of {}; {} in all, half of the tiles have at most {}.</p>",
            HumanCount(count as u64),
            HumanBytes(all),
            HumanBytes(self.bytes[count / 2])
        )
    }
}

fn area(area_m2: f64) -> String {
    if area_m2 >= 1e6 { format!("{:.2} km²", area_m2 / 1e6) } else { format!("{} m²", rounded(area_m2)) }
}

/// Rounds a height to hundredths of a metre. Returns 0 instead of -0.
fn hundredths(height_m: f64) -> f64 {
    (height_m * 100.0).round() / 100.0 + 0.0
}
