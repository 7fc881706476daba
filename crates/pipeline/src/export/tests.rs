use super::{ExportOptions, WhichVoxels, Written, export};
use crate::watch::Watch;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::Path;
use voxtile::{Error, Result};
use voxtile_formats::write::{
    Origin, OutputFormat, OutputFormats, OutputOption, VoxelRow, VoxelSink, Writer,
};

/// A format of the caller, unknown to voxtile: one line per voxel.
struct IndexSink<W> {
    out: W,
}

impl<W: Write> VoxelSink for IndexSink<W> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let [x, y, z] = voxel.index;
        writeln!(self.out, "{x} {y} {z}").map_err(|error| Error::io(Path::new("index"), "write", error))
    }

    fn finish(mut self: Box<Self>) -> Result<()> {
        self.out.flush().map_err(|error| Error::io(Path::new("index"), "write", error))
    }
}

const INDEX: OutputFormat = OutputFormat {
    name: "index",
    extension: Some("index"),
    help: "Indices of voxels",
    feature: None,
    takes: &[OutputOption::Which],
    origin: Origin::Map,
    refusal: "it cannot store it",
    is_text: true,
    needs_free_voxels: true,
    writer: Writer::Files(|_, path, _| {
        let file = File::create(path).map_err(|error| Error::io(path, "create", error))?;
        Ok(Box::new(IndexSink { out: BufWriter::new(file) }))
    }),
};

const INDEX_STREAM: OutputFormat = OutputFormat {
    name: "index-stream",
    extension: Some("index.stream"),
    origin: Origin::Corner,
    needs_free_voxels: false,
    writer: Writer::Stream(|_, out, _| Ok(Box::new(IndexSink { out }))),
    ..INDEX
};

fn options(output: &Path) -> ExportOptions {
    let map = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../map_tiles_example");
    let mut options = ExportOptions::new(map, output);
    options.formats = OutputFormats::default().with(INDEX).with(INDEX_STREAM);
    options
}

#[test]
fn formats_of_the_caller_can_be_exported() {
    let folder = tempfile::tempdir().unwrap();
    let lines = |name: &str, which| {
        let path = folder.path().join(name);
        let mut options = options(&path);
        options.which = which;
        let summary = export(&options, &Watch::silent()).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count() as u64, summary.voxels);
        let is_stream = matches!(summary.written, Written::Stream { .. });
        assert_eq!(is_stream, name.ends_with("stream"));
        text
    };
    let all = lines("a.index", None);
    assert_eq!(all, lines("a.index", Some(WhichVoxels::All)));
    let occupied = lines("a.INDEX", Some(WhichVoxels::Occupied));
    assert!(!occupied.is_empty() && occupied.len() < all.len());
    // The longest matching extension is used, so this is not the stream format.
    assert_eq!(lines("a.index.stream", None), occupied);
    assert_eq!(lines("a.index.stream", Some(WhichVoxels::AtLeast(0.0))), all);
    let mut named = options(&folder.path().join("a.ply"));
    named.format = Some("Index".to_owned());
    export(&named, &Watch::silent()).unwrap();
    assert_eq!(fs::read_to_string(folder.path().join("a.ply")).unwrap(), all);
}

#[test]
fn unsupported_options_are_refused_with_alternatives() {
    let folder = tempfile::tempdir().unwrap();
    let refusal = |name: &str, change: fn(&mut ExportOptions)| {
        let output = if name == "-" { name.into() } else { folder.path().join(name) };
        let mut options = options(&output);
        change(&mut options);
        export(&options, &Watch::silent()).unwrap_err().to_string()
    };
    let heights = refusal("a.index", |options| options.z_min_m = Some(1.0));
    assert!(
        heights.contains(
            "index does not support it; formats that support it: nav2 heightmap geotiff; it cannot store it"
        ),
        "{heights}"
    );
    let origin = refusal("a.index", |options| options.origin_m = Some([1.0; 3]));
    assert!(origin.contains("index always has map coordinates"), "{origin}");
    let stream = refusal("-", |options| options.format = Some("index".to_owned()));
    assert!(stream.contains("index cannot be written to standard output"), "{stream}");
    let unknown = refusal("a.what", |_| ());
    assert!(unknown.contains(".copc.laz") && unknown.contains(".index .index.stream;"), "{unknown}");
    let unnamed = refusal("-", |_| ());
    assert!(unnamed.contains("ply pcd csv bt ot index-stream"), "{unnamed}");
    let misnamed = refusal("a.ply", |options| options.format = Some("play".to_owned()));
    assert!(
        misnamed.contains("`play` is an unknown format") && misnamed.contains("3dtiles index"),
        "{misnamed}"
    );
    let wrong = refusal("a.ply", |options| options.which = Some(WhichVoxels::AtLeast(1.5)));
    assert!(wrong.contains("from 0 to 1"), "{wrong}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}
