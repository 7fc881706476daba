use super::pictures::{Pictures, class_of, size_m};
use super::{Report, percent};
use crate::counted::Counted;
use crate::html::{
    Text, begin_page, begin_table, end_page, end_table, number_cell, rounded, row, swatch, write_figure,
    write_picture,
};
use indicatif::HumanCount;
use std::io::{self, Write};
use voxtile::space::Aabb;
use voxtile_compare::{Change, CompareOptions, EpochCounts, VoxelClass};
use voxtile_render::classes::class_label;
use voxtile_render::{Drawn, colors, time_labels};

/// Page on a comparison.
pub struct Page<'a> {
    pub report: &'a Report,
    pub options: &'a CompareOptions,
    /// Names of the maps.
    pub names: [String; 2],
    pub pictures: Pictures,
}

/// Maximum number of changes in the table.
const MAX_LISTED: usize = 50;
const SECONDS_A_NS: f64 = 1e-9;

impl Page<'_> {
    /// Writes the page.
    pub fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let heading = self.names.join(" → ");
        let line = format!("Changes between two maps, by voxtile {}", env!("CARGO_PKG_VERSION"));
        begin_page(out, &format!("{heading}: changes"), &heading, &line)?;
        for warning in &self.report.warnings {
            writeln!(out, "<p class=\"bad\">Warning: {}</p>", Text(warning))?;
        }
        self.write_summary(out)?;
        self.write_overlap(out)?;
        self.write_counts(out)?;
        self.write_changes(out)?;
        self.write_close_ups(out)?;
        self.write_options(out)?;
        end_page(out)
    }

    fn write_summary(&self, out: &mut impl Write) -> io::Result<()> {
        let comparison = &self.report.comparison;
        writeln!(out, "<div class=\"big\">")?;
        for (clusters, class) in
            [(&comparison.appeared, VoxelClass::Appeared), (&comparison.vanished, VoxelClass::Vanished)]
        {
            let (count, name) = (HumanCount(clusters.clusters), class.name());
            let volume = rounded(self.volume_m3(clusters.voxels));
            let square = swatch(colors::comparison_color(class));
            writeln!(
                out,
                "<div><b>{count}</b><span class=\"faint\">{square} {name}, {volume} m³ of voxels</span></div>"
            )?;
        }
        for (counts, of, other) in
            [(&comparison.before, "earlier", "later"), (&comparison.after, "later", "earlier")]
        {
            let share = 100.0 * counts.seen_share();
            let name = format!("of the {of} map seen in the {other} one");
            writeln!(out, "<div><b>{share:.1} %</b><span class=\"faint\">{name}</span></div>")?;
        }
        writeln!(out, "</div>")
    }

    fn write_overlap(&self, out: &mut impl Write) -> io::Result<()> {
        let Some((drawn, region)) =
            self.pictures.overlap.as_ref().and_then(|drawn| Some((drawn, drawn.region_m.as_ref()?)))
        else {
            return writeln!(
                out,
                "<p>There is no picture: the maps have no occupied voxels in a common place.</p>"
            );
        };
        let boxes = if self.pictures.changes.is_empty() { "" } else { " Boxes: the largest changes." };
        let [x, y] = [0, 1].map(|k| format!("{:.2} to {:.2} m", region.min[k], region.max[k]));
        let caption = format!(
            "The space of both maps from above: x {x}, y {y}; {} m per cell.{boxes}",
            rounded(drawn.cell_m)
        );
        write_picture(out, drawn, &caption)
    }

    fn write_counts(&self, out: &mut impl Write) -> io::Result<()> {
        let comparison = &self.report.comparison;
        let columns = ["class", "of the", "the other map", "#voxels", "#m³", "#share of the map"];
        begin_table(out, "Occupied voxels", &columns)?;
        let (before, after) = ((&comparison.before, "earlier map"), (&comparison.after, "later map"));
        type Count = fn(&EpochCounts) -> u64;
        let (unchanged, changed): (Count, Count) = (|counts| counts.unchanged, |counts| counts.changed);
        let (not_seen, uncertain): (Count, Count) =
            (|counts| counts.not_seen - counts.hidden.unwrap_or(0), |counts| counts.uncertain);
        let hidden: Count = |counts| counts.hidden.unwrap_or(0);
        let [occupied, free] = ["has an occupied voxel within the tolerance", "has seen the place free"];
        let [unknown, unclear] = ["has not observed the place", "has perhaps seen the place free"];
        let behind = "had something in front of the place";
        for (class, (counts, map), other, count) in [
            (VoxelClass::Appeared, after, free, changed),
            (VoxelClass::Vanished, before, free, changed),
            (VoxelClass::UncertainAppeared, after, unclear, uncertain),
            (VoxelClass::UncertainVanished, before, unclear, uncertain),
            (VoxelClass::HiddenBefore, after, behind, hidden),
            (VoxelClass::HiddenAfter, before, behind, hidden),
            (VoxelClass::NotSeenBefore, after, unknown, not_seen),
            (VoxelClass::NotSeenAfter, before, unknown, not_seen),
            (VoxelClass::Unchanged, after, occupied, unchanged),
            (VoxelClass::Unchanged, before, occupied, unchanged),
        ] {
            let is_hidden = matches!(class, VoxelClass::HiddenBefore | VoxelClass::HiddenAfter);
            if is_hidden && counts.hidden.is_none() {
                continue;
            }
            let (square, voxels) = (swatch(colors::comparison_color(class)), count(counts));
            write!(
                out,
                "<tr><td>{square} {}</td><td>{map}</td><td>{other}</td>",
                class.name().replace('_', " ")
            )?;
            number_cell(out, HumanCount(voxels))?;
            number_cell(out, rounded(self.volume_m3(voxels)))?;
            number_cell(out, format!("{:.1} %", percent(voxels, counts)))?;
            writeln!(out, "</tr>")?;
        }
        end_table(out)
    }

    fn write_changes(&self, out: &mut impl Write) -> io::Result<()> {
        let comparison = &self.report.comparison;
        let listed = &comparison.changes[..comparison.changes.len().min(MAX_LISTED)];
        if listed.is_empty() {
            return writeln!(
                out,
                "<h2>Changes</h2>\n<p>No cluster of changed voxels has {} or more.</p>",
                Counted(comparison.min_voxels, "voxel")
            );
        }
        let of_layers = OfLayers::of(listed);
        let mut columns =
            vec!["#number", "class", "#center of the box, m", "#size, m", "#volume, m³", "#voxels"];
        columns.extend(of_layers.columns());
        begin_table(out, "Changes, the largest first", &columns)?;
        for change in listed {
            let Aabb { min, max } = change.bounds_m;
            let center: [f64; 3] = std::array::from_fn(|k| 0.5 * (min[k] + max[k]));
            write!(out, "<tr>")?;
            number_cell(out, change.number)?;
            write!(out, "<td>{} {}</td>", swatch(color_of(change)), change.kind.name())?;
            number_cell(out, numbers(center, " "))?;
            number_cell(out, numbers(size_m(&change.bounds_m), " x "))?;
            number_cell(out, rounded(change.volume_m3))?;
            number_cell(out, HumanCount(change.voxels))?;
            of_layers.write(out, change)?;
            writeln!(out, "</tr>")?;
        }
        end_table(out)?;
        let more = comparison.changes.len() - listed.len();
        let small = [&comparison.appeared, &comparison.vanished].map(|all| all.small_clusters);
        let small = small.iter().sum::<u64>();
        if more > 0 {
            let more = HumanCount(more as u64);
            writeln!(out, "<p class=\"faint\">{more} more; <code>--list</code> writes all.</p>")?;
        }
        if small > 0 {
            let (small, least) = (Counted(small, "smaller cluster"), comparison.min_voxels);
            writeln!(out, "<p class=\"faint\">{small} of fewer than {least} voxels, not listed.</p>")?;
        }
        Ok(())
    }

    fn write_close_ups(&self, out: &mut impl Write) -> io::Result<()> {
        if self.pictures.changes.is_empty() {
            return Ok(());
        }
        writeln!(out, "<h2>The largest changes, from above and from the side</h2>\n<div class=\"changes\">")?;
        for (change, pictures) in self.report.comparison.changes.iter().zip(&self.pictures.changes) {
            let (number, kind, voxels) = (change.number, change.kind.name(), Counted(change.voxels, "voxel"));
            writeln!(out, "<section><h3>{} {number} {kind}, {voxels}</h3><div>", swatch(color_of(change)))?;
            for (drawn, from) in pictures.iter().zip(["above", "the side"]) {
                write_figure(out, drawn, &extent(drawn), &format!("Change {number}, {kind}, from {from}"))?;
            }
            writeln!(out, "</div></section>")?;
        }
        writeln!(out, "</div>")
    }

    fn write_options(&self, out: &mut impl Write) -> io::Result<()> {
        let Report { maps, resolution_m, crs, comparison, .. } = self.report;
        begin_table(out, "Maps and options", &[])?;
        for (name, side) in ["earlier map", "later map"].iter().zip(maps) {
            row(out, name, Text(side.name()))?;
        }
        row(out, "resolution", format!("{resolution_m} m"))?;
        if let Some(crs) = crs {
            row(out, "coordinate reference system", Text(crs))?;
        }
        let tolerance = Counted(u64::from(comparison.tolerance_voxels), "voxel");
        let tolerance_m = f64::from(comparison.tolerance_voxels) * resolution_m;
        row(out, "tolerance", format!("{tolerance} ({tolerance_m:.3} m)"))?;
        row(out, "certainty", format!("probability {}", self.options.certainty))?;
        row(out, "smallest listed change", Counted(comparison.min_voxels, "voxel"))?;
        if let Some(region) = &self.options.region {
            row(out, "region", format!("{:?} to {:?} m", region.min, region.max))?;
        }
        end_table(out)
    }

    fn volume_m3(&self, voxels: u64) -> f64 {
        voxels as f64 * self.report.resolution_m.powi(3)
    }
}

/// The layers that some change has.
struct OfLayers {
    colour: bool,
    class: bool,
    time: bool,
}

impl OfLayers {
    fn of(changes: &[Change]) -> Self {
        Self {
            colour: changes.iter().any(|change| change.colour.is_some()),
            class: changes.iter().any(|change| change.class.is_some()),
            time: changes.iter().any(|change| change.time_ns.is_some()),
        }
    }

    fn columns(&self) -> impl Iterator<Item = &'static str> {
        let all =
            [(self.colour, "color"), (self.class, "class of most points"), (self.time, "first and last hit")];
        all.into_iter().filter(|(has, _)| *has).map(|(_, name)| name)
    }

    fn write(&self, out: &mut impl Write, change: &Change) -> io::Result<()> {
        if self.colour {
            write!(out, "<td>{}</td>", change.colour.map(swatch).unwrap_or_default())?;
        }
        if self.class {
            write!(out, "<td>{}</td>", Text(change.class.map(class_label).unwrap_or_default()))?;
        }
        if self.time {
            let labels =
                change.time_ns.map(|time_ns| time_labels(time_ns.map(|ns| ns as f64 * SECONDS_A_NS)));
            write!(out, "<td>{}</td>", labels.map(|labels| labels.join(" to ")).unwrap_or_default())?;
        }
        Ok(())
    }
}

fn color_of(change: &Change) -> colors::Rgb {
    colors::comparison_color(class_of(change.kind))
}

/// Returns the edges of a picture.
fn extent(drawn: &Drawn) -> String {
    let [width, height] =
        [drawn.map_px[2], drawn.map_px[3]].map(|pixels| pixels as f64 / drawn.cell_px as f64 * drawn.cell_m);
    format!("{width:.1} x {height:.1} m")
}

fn numbers(values: [f64; 3], between: &str) -> String {
    // Adding 0 converts -0 to 0.
    values.map(|value| format!("{:.2}", (value * 100.0).round() / 100.0 + 0.0)).join(between)
}
