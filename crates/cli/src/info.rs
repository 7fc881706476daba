use crate::args::InfoArgs;
use crate::json;
use crate::octree_info;
use crate::region_tiles;
use indicatif::{HumanBytes, HumanCount};
use serde::Serialize;
use std::io::Write;
use std::process::ExitCode;
use voxtile::mapper::{MapReader, MapView, OctreeMap};
use voxtile::operations::{KeptBytes, kept_bytes};
use voxtile::sensor::SensorModel;
use voxtile::space::{Aabb, Grid, TileBox};
use voxtile::store::{Bounds, InputRecord, MapPath};
use voxtile::{Clearing, Layers, MapQueries, Result, Storage};
use voxtile_pipeline::read_map;

/// Maximum number of inputs in text; JSON lists all.
const INPUTS_SHOWN: usize = 5;

/// Properties of a map from its metadata, without reading tiles.
#[derive(Debug, Serialize)]
pub struct Info {
    pub map_id: Option<String>,
    pub verified: bool,
    pub resolution_m: f64,
    pub tile_size_m: f64,
    pub sensor_model: SensorModel,
    pub occupancy_threshold: f64,
    /// Rule for the misses of rays.
    pub clearing: Clearing,
    #[serde(skip_serializing_if = "Layers::is_none")]
    pub layers: Layers,
    pub storage: Storage,
    pub scan_number: u64,
    pub flush_number: u64,
    pub crs: Option<String>,
    pub inputs: Vec<InputRecord>,
    /// Number of the last scan at the latest decay; 0 without decay.
    pub decayed_scan: u64,
    pub tiles: u64,
    /// Tiles of the region that the map is limited to; absent if the map is not limited.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub region_tiles: Option<TileBox>,
    pub tile_bounds: Option<Bounds>,
    pub bounds_m: Option<Aabb>,
    pub voxels: u64,
    pub occupied: u64,
    pub table_bytes: u64,
    pub octree_bytes: u64,
    /// Data stored in addition to the current map; `None` for a snapshot.
    pub kept: Option<KeptBytes>,
}

pub fn run(args: &InfoArgs) -> anyhow::Result<ExitCode> {
    let mut out = std::io::stdout().lock();
    if OctreeMap::is_named_by(&args.map) {
        octree_info::print_info(&args.map, args.json, &mut out)?;
        return Ok(ExitCode::SUCCESS);
    }
    let info = read_map(&args.map, |reader| Ok(Info::of(reader)?))?;
    if args.json {
        json::print(&info, &mut out)?;
    } else {
        info.print(&mut out)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl Info {
    /// Reads the properties of a map.
    pub fn of(reader: &MapReader) -> Result<Self> {
        let config = reader.config();
        let ext = reader.metadata().ext.as_ref();
        let tile_bounds = Bounds::of(reader.tile_indices().into_iter());
        let tile_size_m = config.grid.tile_size_m();
        let corner = |index: [i32; 3], add: i64| index.map(|k| (i64::from(k) + add) as f64 * tile_size_m);
        let (voxels, occupied) = match reader.voxel_counts() {
            Some(counts) => counts,
            None => count(reader)?,
        };
        let (table_bytes, octree_bytes) = reader.disk_bytes().unwrap_or_default();
        Ok(Self {
            map_id: ext.map(|ext| ext.map_id.clone()),
            verified: reader.is_verified(),
            resolution_m: config.grid.resolution_m(),
            tile_size_m,
            sensor_model: config.sensor_model,
            occupancy_threshold: config.occupancy_threshold,
            clearing: config.rays.clearing(),
            layers: config.layers(),
            storage: config.storage,
            scan_number: reader.scan_number(),
            flush_number: reader.flush_number(),
            crs: config.crs.clone(),
            inputs: ext.map_or(Vec::new(), |ext| ext.inputs.clone()),
            decayed_scan: ext.map_or(0, |ext| ext.decayed_scan),
            tiles: reader.tile_indices().len() as u64,
            region_tiles: config.rays.region,
            tile_bounds,
            bounds_m: tile_bounds
                .map(|bounds| Aabb { min: corner(bounds.min, 0), max: corner(bounds.max, 1) }),
            voxels,
            occupied,
            table_bytes,
            octree_bytes,
            kept: reader
                .snapshot()
                .is_none()
                .then(|| kept_bytes(MapPath::on(reader.disk(), reader.folder())))
                .transpose()?,
        })
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let id =
            self.map_id.as_deref().unwrap_or("none (original format without checksums, cannot be verified)");
        writeln!(out, "map id       {id}")?;
        writeln!(out, "resolution   {} m, tiles of {} m", self.resolution_m, self.tile_size_m)?;
        let model = self.sensor_model.name();
        writeln!(out, "model        {model}, occupied from probability {}", self.occupancy_threshold)?;
        if self.clearing != Clearing::Octomap {
            writeln!(out, "clearing     {}", self.clearing)?;
        }
        if !self.layers.is_none() {
            writeln!(out, "layers       {}", self.layers)?;
        }
        if let Some(tiles) = self.region_tiles
            && let Ok(grid) = Grid::new(self.resolution_m, self.tile_size_m)
        {
            writeln!(out, "region       {}", region_tiles::text(tiles, &grid))?;
        }
        writeln!(
            out,
            "scans        {} in {} flushes",
            HumanCount(self.scan_number),
            HumanCount(self.flush_number)
        )?;
        for input in self.inputs.iter().rev().take(INPUTS_SHOWN).rev() {
            writeln!(out, "input        from scan {}: {}", HumanCount(input.first_scan), input.name)?;
        }
        if let Some(crs) = &self.crs {
            writeln!(out, "crs          {crs:.100}")?;
        }
        if self.decayed_scan > 0 {
            writeln!(out, "decayed      last after scan {}", HumanCount(self.decayed_scan))?;
        }
        writeln!(out, "tiles        {}", HumanCount(self.tiles))?;
        if let Some(Aabb { min, max }) = self.bounds_m {
            writeln!(out, "bounds       {min:?} to {max:?} m")?;
        }
        writeln!(out, "voxels       {}, {} occupied", HumanCount(self.voxels), HumanCount(self.occupied))?;
        let (table, octree) = (HumanBytes(self.table_bytes), HumanBytes(self.octree_bytes));
        match self.storage {
            Storage::OctoMap => writeln!(out, "on disk      {table} in tables, {octree} in octrees")?,
            Storage::Compact => writeln!(out, "on disk      {table} in compact tables")?,
        }
        let Some(kept) = &self.kept else { return Ok(()) };
        if kept.snapshot_tables > 0 {
            let (bytes, tables) = (HumanBytes(kept.snapshot_bytes), HumanCount(kept.snapshot_tables));
            writeln!(out, "snapshots    {bytes} in {tables} tables used only by snapshots")?;
        }
        if kept.reader_tables > 0 {
            let (bytes, tables) = (HumanBytes(kept.reader_bytes), HumanCount(kept.reader_tables));
            writeln!(out, "readers      {bytes} in {tables} older tables in use by readers")?;
        }
        Ok(())
    }
}

/// Counts observed and occupied voxels, tile by tile.
fn count(reader: &MapReader) -> Result<(u64, u64)> {
    let (mut voxels, mut occupied) = (0, 0);
    reader.for_each_occupied(Some(0.0), None, |_| voxels += 1)?;
    reader.for_each_occupied(None, None, |_| occupied += 1)?;
    Ok((voxels, occupied))
}
