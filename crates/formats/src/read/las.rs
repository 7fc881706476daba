use super::cloud::{CloudHead, CloudSource};
use super::las_colours::LasColours;
use super::las_count::settle;
use super::las_hints::hints;
use super::las_layout::Layout;
use super::las_points::LasPoints;
use super::las_record::{ATTRIBUTED_BYTES, PLAIN_BYTES};
use super::las_scans::LasScans;
use super::las_units::Units;
use super::laz_chunks::Chunks;
use super::one::{Visit, head_of};
use crate::read_options::ReadOptions;
use std::fs::File;
use std::path::Path;
use voxtile::{Error, Result};

/// Opens a LAS, LAZ or COPC file. Coordinates are converted to metres. A file with GPS times is split into scans of
/// [`ReadOptions::scan_period_s`], numbered from 0 and stamped with the middle of their window. A file without GPS
/// times, or with a given ray origin, is one cloud in file order.
///
/// Stamps are GPS time in nanoseconds, without leap seconds removed. If the header declares "adjusted standard GPS
/// time", they count from 6 January 1980: the offset of 10^9 s, or that of LAS 1.5, is added. Otherwise they count from
/// the start of the GPS week.
pub(crate) fn open(path: &Path, options: &ReadOptions) -> Result<Box<dyn CloudSource>> {
    let mut file = File::open(path).map_err(|error| Error::io(path, "read", error))?;
    let mut layout = Layout::read(path, &mut file)?;
    let chunks = match layout.is_compressed {
        true => Some(Chunks::read(path, &file, &mut layout, &options.budget())?),
        false => settle(path, &mut file, &mut layout).map(|()| None)?,
    };
    let mut units = Units::of(&layout);
    units.remarks.extend(hints(&layout, &units));
    units.remarks.append(&mut layout.remarks);
    let colour_chunks = if options.attributes.colours { chunks.clone() } else { None };
    let mut points = LasPoints::open(path, &layout, chunks, &units, options)?;
    if options.attributes.colours && points.has_colours() {
        points.set_colours(LasColours::find(path, &layout, colour_chunks, &units, options)?);
    }
    let format = if layout.is_compressed { "LAZ" } else { "LAS" }.to_owned();
    let is_cut = points.has_times() && options.scan_period_s > 0.0 && options.sensor_origin_m.is_none();
    if is_cut {
        return Ok(match points.attributes().is_none() {
            true => Box::new(LasScans::<PLAIN_BYTES>::new(format, path, &layout, units, points, options)),
            false => {
                Box::new(LasScans::<ATTRIBUTED_BYTES>::new(format, path, &layout, units, points, options))
            }
        });
    }
    let head = CloudHead {
        points: Some(layout.points),
        fields: fields(points.has_times()),
        has_intensities: true,
        attributes: points.attributes(),
        ..head_of(path)
    };
    Ok(Box::new(WholeLas { format, units, head: Some(head), points, is_read: false }))
}

/// Returns the names of the fields to read.
pub(super) fn fields(has_times: bool) -> Vec<String> {
    let names = ["X", "Y", "Z", "Intensity"].into_iter().chain(has_times.then_some("GPS Time"));
    names.map(str::to_owned).collect()
}

/// Source of a LAS file as one cloud.
struct WholeLas {
    format: String,
    units: Units,
    head: Option<CloudHead>,
    points: LasPoints,
    is_read: bool,
}

impl CloudSource for WholeLas {
    fn format(&self) -> &str {
        &self.format
    }

    fn len_hint(&self) -> Option<u64> {
        Some(1)
    }

    fn next_cloud(&mut self) -> Result<Option<CloudHead>> {
        let head = self.head.take();
        self.is_read |= head.is_none();
        Ok(head)
    }

    fn read_points(&mut self, visit: Visit<'_>) -> Result<()> {
        if self.head.is_some() || self.is_read {
            return Ok(());
        }
        self.is_read = true;
        let attributes = self.points.attributes();
        self.points.visit(&mut |point| visit(point.cloud_point(attributes)))
    }

    fn remarks(&self) -> Vec<String> {
        self.units.remarks.iter().cloned().chain(self.points.remarks()).collect()
    }

    fn crs(&self) -> Option<&str> {
        self.units.crs.as_deref()
    }
}
