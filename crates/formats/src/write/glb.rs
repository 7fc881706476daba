use super::glb_json;
use super::greedy::{BRICK, Brick, Quad};
use super::lattice::Lattice;
use super::options::WriteOptions;
use super::out_file::OutFile;
use super::row::{VoxelRow, VoxelSink, VoxelsHead};
use super::sort::{ExternalSort, key, of_key, part};
use super::spool::Spool;
use super::srgb::linear_of_srgb;
use super::{Error, Result};
use std::path::PathBuf;

/// Size of a sort record: a brick index, a voxel position in the brick, and a colour.
const RECORD_BYTES: usize = 18;

/// Size of the six indices of a face.
const INDEX_BYTES: u64 = 24;

/// Colours of heights from low to high: red, green, blue.
const COLOURS: [[f64; 3]; 5] =
    [[68.0, 1.0, 84.0], [59.0, 82.0, 139.0], [33.0, 145.0, 140.0], [94.0, 201.0, 98.0], [253.0, 231.0, 37.0]];

/// Colour of voxels without one in a map with colours.
const GRAY: [u8; 3] = [128; 3];

/// Writer of the surface of occupied voxels as binary glTF, in the colours of the voxels, or of their heights in a map
/// without colours. Voxels are sorted into bricks that include their
/// neighbouring voxels, so that faces at brick borders are exact.
pub(super) struct GlbSink {
    out: OutFile,
    head: VoxelsHead,
    crs: Option<String>,
    scratch_folder: PathBuf,
    colour_heights_m: Option<[f64; 2]>,
    is_quantized: bool,
    places: ExternalSort<RECORD_BYTES>,
    lattice: Option<Lattice>,
    least: [i32; 3],
    most: [i32; 3],
}

/// Encoding of vertices.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct VertexLayout {
    /// Positions are 16-bit integers, which require the extension `KHR_mesh_quantization`; else integers in single
    /// precision, exact up to 2^24.
    pub(super) is_short: bool,
    /// Colours are those of voxels, converted to linear light with 16 bits; else those of heights with 8 bits.
    pub(super) is_coloured: bool,
}

/// Properties of the mesh, for the file header.
pub(super) struct Surface {
    pub(super) quads: u64,
    pub(super) layout: VertexLayout,
    pub(super) resolution_m: f64,
    /// Lower corner of all occupied voxels in the map frame (z up).
    pub(super) corner_m: [f64; 3],
    /// Number of voxels along x, y and z.
    pub(super) size: [i64; 3],
    /// Bounds of the vertices in the glTF frame (y up).
    pub(super) least: [i64; 3],
    pub(super) most: [i64; 3],
    pub(super) crs: Option<String>,
}

impl GlbSink {
    pub(super) fn create(head: &VoxelsHead, path: &std::path::Path, options: &WriteOptions) -> Result<Self> {
        Ok(Self {
            out: OutFile::create(path)?,
            head: head.clone(),
            crs: options.crs.clone(),
            scratch_folder: options.scratch_folder.clone(),
            colour_heights_m: options.colour_heights_m,
            is_quantized: options.is_quantized,
            places: ExternalSort::new(&options.scratch_folder),
            lattice: None,
            least: [i32::MAX; 3],
            most: [i32::MIN; 3],
        })
    }
}

impl VertexLayout {
    /// Size of a position, and with it the offset of the colour.
    pub(super) fn position_bytes(self) -> usize {
        if self.is_short { 8 } else { 12 }
    }

    /// Size of a vertex.
    pub(super) fn bytes(self) -> usize {
        self.position_bytes() + if self.is_coloured { 8 } else { 4 }
    }

    fn push_position(self, bytes: &mut Vec<u8>, place: [i64; 3]) {
        match self.is_short {
            true => {
                bytes.extend(place.map(|k| (k as u16).to_le_bytes()).as_flattened());
                bytes.extend([0; 2]);
            }
            false => bytes.extend(place.map(|k| (k as f32).to_le_bytes()).as_flattened()),
        }
    }
}

impl VoxelSink for GlbSink {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        if voxel.log_odds < self.head.occupied_log_odds {
            return Ok(());
        }
        self.lattice.get_or_insert_with(|| Lattice::of(voxel, self.head.resolution_m));
        let edge = BRICK as i32;
        let (brick, place) =
            (voxel.index.map(|k| k.div_euclid(edge)), voxel.index.map(|k| k.rem_euclid(edge)));
        // Without the layer all voxels have one colour, and faces are merged whatever it is.
        let colour = voxel.layers.colour.filter(|_| self.head.layers.colour).unwrap_or(GRAY);
        self.places.push(record(brick, place, colour))?;
        for k in 0..3 {
            self.least[k] = self.least[k].min(voxel.index[k]);
            self.most[k] = self.most[k].max(voxel.index[k]);
            let (mut neighbor, mut around) = (brick, place);
            if place[k] == 0 {
                (neighbor[k], around[k]) = (brick[k] - 1, edge);
            } else if place[k] == edge - 1 {
                (neighbor[k], around[k]) = (brick[k] + 1, -1);
            } else {
                continue;
            }
            self.places.push(record(neighbor, around, colour))?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        let Self {
            mut out,
            head,
            crs,
            scratch_folder,
            colour_heights_m,
            is_quantized,
            places,
            lattice,
            least,
            most,
        } = *self;
        let size: [i64; 3] = std::array::from_fn(|k| (i64::from(most[k]) - i64::from(least[k]) + 1).max(0));
        let longest = size.iter().copied().max().unwrap_or(0);
        if longest > 1 << 24 {
            let reason = format!("{longest} voxels along a side exceed single precision");
            return Err(Error::argument("GLB", format!("{reason}; choose a region")));
        }
        let is_short = is_quantized && longest <= i64::from(u16::MAX);
        let layout = VertexLayout { is_short, is_coloured: head.layers.colour };
        let corner_m = lattice.map_or([0.0; 3], |lattice| lattice.corner_m(least.map(i64::from)));
        let mut mesh = Mesh {
            vertices: Spool::new(&scratch_folder)?,
            indices: Spool::new(&scratch_folder)?,
            bytes: Vec::new(),
            colour_heights_m,
            surface: Surface {
                quads: 0,
                layout,
                resolution_m: head.resolution_m,
                corner_m,
                size,
                least: [i64::MAX; 3],
                most: [i64::MIN; 3],
                crs,
            },
        };
        let (mut sorted, mut brick, mut last) = (places.into_sorted()?, Brick::new(), None);
        while let Some(record) = sorted.next()? {
            let index = [0, 4, 8].map(|at| i64::from(of_key(part(&record, at))));
            if let Some(done) = last.replace(index).filter(|&done| done != index) {
                mesh.add(&brick, done, least)?;
                brick.clear();
            }
            brick.insert(part(&record, 12), part(&record, 15));
        }
        if let Some(done) = last {
            mesh.add(&brick, done, least)?;
        }
        mesh.write(&mut out)?;
        out.finish()
    }
}

fn record(brick: [i32; 3], place: [i32; 3], colour: [u8; 3]) -> [u8; RECORD_BYTES] {
    let mut record = [0; RECORD_BYTES];
    record[..12].copy_from_slice(brick.map(key).as_flattened());
    record[12..15].copy_from_slice(&place.map(|k| (k + 1) as u8));
    record[15..].copy_from_slice(&colour);
    record
}

struct Mesh {
    vertices: Spool,
    indices: Spool,
    bytes: Vec<u8>,
    colour_heights_m: Option<[f64; 2]>,
    surface: Surface,
}

impl Mesh {
    fn add(&mut self, brick: &Brick, index: [i64; 3], least: [i32; 3]) -> Result<()> {
        let mut quads: Vec<Quad> = Vec::new();
        brick.quads(&mut |quad| quads.push(quad));
        for quad in quads {
            self.check_room()?;
            self.bytes.clear();
            for corner in quad.corners {
                let place: [i64; 3] = std::array::from_fn(|k| {
                    index[k] * BRICK as i64 + i64::from(corner[k]) - i64::from(least[k])
                });
                let turned = [place[0], place[2], self.surface.size[1] - place[1]];
                for (k, &at) in turned.iter().enumerate() {
                    self.surface.least[k] = self.surface.least[k].min(at);
                    self.surface.most[k] = self.surface.most[k].max(at);
                }
                self.surface.layout.push_position(&mut self.bytes, turned);
                if self.surface.layout.is_coloured {
                    let [red, green, blue] = quad.colour.map(linear_of_srgb);
                    self.bytes.extend([red, green, blue, u16::MAX].map(u16::to_le_bytes).as_flattened());
                } else {
                    self.bytes.extend(colour(self.share_of_height(place[2])));
                }
            }
            self.vertices.write(&self.bytes)?;
            let first =
                u32::try_from(4 * self.surface.quads).ok().filter(|first| first.checked_add(4).is_some());
            let first = first.ok_or_else(too_large)?;
            let indices = [0, 1, 2, 0, 2, 3].map(|k| (first + k).to_le_bytes());
            self.indices.write(indices.as_flattened())?;
            self.surface.quads += 1;
        }
        Ok(())
    }

    /// Checks that the file can hold one more face, before the scratch files grow beyond the limit.
    fn check_room(&self) -> Result<()> {
        let bytes = 4 * self.surface.layout.bytes() as u64 + INDEX_BYTES;
        if (self.surface.quads + 1) * bytes > u64::from(u32::MAX) { Err(too_large()) } else { Ok(()) }
    }

    /// Returns the position of a height in the coloured range: 0 is the first colour, 1 the last.
    fn share_of_height(&self, place: i64) -> f64 {
        match self.colour_heights_m {
            Some([low, high]) if high > low => {
                (self.surface.corner_m[2] + place as f64 * self.surface.resolution_m - low) / (high - low)
            }
            _ => place as f64 / self.surface.size[2].max(1) as f64,
        }
    }

    fn write(self, out: &mut OutFile) -> Result<()> {
        let mut json = glb_json::of(&self.surface).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let binary = self.vertices.len() + self.indices.len();
        let chunk = if binary == 0 { 0 } else { 8 + binary };
        let short = |number: u64| u32::try_from(number).map(u32::to_le_bytes).map_err(|_| too_large());
        let mut head = b"glTF\x02\x00\x00\x00".to_vec();
        head.extend(short(12 + 8 + json.len() as u64 + chunk)?);
        head.extend(short(json.len() as u64)?);
        head.extend(b"JSON");
        head.extend(json);
        if binary > 0 {
            head.extend(short(binary)?);
            head.extend(b"BIN\x00");
        }
        out.write(&head)?;
        out.append(self.vertices.into_reader()?.file())?;
        out.append(self.indices.into_reader()?.file())?;
        Ok(())
    }
}

fn too_large() -> Error {
    Error::argument("GLB", "the mesh exceeds 4 GiB, the limit of this format: choose a region")
}

/// Returns the opaque colour of a height from 0 to 1.
fn colour(share: f64) -> [u8; 4] {
    let along = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (along as usize).min(COLOURS.len() - 2);
    let part = along - below as f64;
    let mixed = |k: usize| COLOURS[below][k] + part * (COLOURS[below + 1][k] - COLOURS[below][k]);
    [mixed(0).round() as u8, mixed(1).round() as u8, mixed(2).round() as u8, 255]
}

#[cfg(test)]
mod tests {
    use super::super::testing::{head_of, row};
    use super::*;
    use std::collections::HashSet;

    /// Returns the unit faces of a file: the centre of each, doubled, and its normal.
    fn faces(rows: &[VoxelRow], is_quantized: bool) -> Vec<([i64; 3], [i64; 3])> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        let options = WriteOptions { is_quantized, ..WriteOptions::for_path(&path) };
        let mut sink = Box::new(GlbSink::create(&head_of(rows), &path, &options).unwrap());
        rows.iter().for_each(|row| sink.put(row).unwrap());
        sink.finish().unwrap();
        let bytes = std::fs::read(path).unwrap();
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!(u32_at(8), bytes.len());
        let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + u32_at(12)]).unwrap();
        let origin = json["nodes"][0]["extras"]["origin_m"].as_array().unwrap();
        let origin: Vec<i64> = origin.iter().map(|m| (m.as_f64().unwrap() / 0.5).round() as i64).collect();
        let top = origin[1] as f64 * 0.5
            - json["nodes"][0]["translation"][2].as_f64().unwrap()
            - origin[1] as f64 * 0.5;
        let top = (top / 0.5).round() as i64;
        let count = json["accessors"][0]["count"].as_u64().unwrap() as usize;
        let start = 20 + u32_at(12) + 8;
        assert_eq!(json["extensionsRequired"].is_array(), is_quantized);
        assert_eq!(json["accessors"][0]["componentType"], if is_quantized { 5123 } else { 5126 });
        let vertex = |k: usize| {
            let at = |n: usize| match is_quantized {
                true => {
                    i64::from(u16::from_le_bytes(*bytes[start + 12 * k + 2 * n..].first_chunk().unwrap()))
                }
                false => f32::from_le_bytes(*bytes[start + 16 * k + 4 * n..].first_chunk().unwrap()) as i64,
            };
            [origin[0] + at(0), top - at(2), origin[2] + at(1)]
        };
        let mut faces = Vec::new();
        for quad in 0..count / 4 {
            let [a, b, c] = [0, 1, 2].map(|k| vertex(4 * quad + k));
            let (u, v): ([i64; 3], [i64; 3]) =
                (std::array::from_fn(|k| b[k] - a[k]), std::array::from_fn(|k| c[k] - b[k]));
            let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]
                .map(i64::signum);
            let (low, high): ([i64; 3], [i64; 3]) = (
                std::array::from_fn(|k| a[k].min(c[k])),
                std::array::from_fn(|k| a[k].max(c[k]).max(a[k].min(c[k]) + 1)),
            );
            for x in low[0]..high[0] {
                for y in low[1]..high[1] {
                    for z in low[2]..high[2] {
                        let place = [x, y, z];
                        let middle = std::array::from_fn(|k| 2 * place[k] + i64::from(normal[k] == 0));
                        faces.push((middle, normal));
                    }
                }
            }
        }
        faces
    }

    #[test]
    fn too_large_meshes_are_refused_early() {
        let folder = tempfile::tempdir().unwrap();
        let mut brick = Brick::new();
        brick.insert([5, 6, 7], GRAY);
        for (is_short, is_coloured, face_bytes) in
            [(true, false, 72), (false, false, 88), (true, true, 88), (false, true, 104)]
        {
            let (layout, most) = (VertexLayout { is_short, is_coloured }, 0xffff_ffff / face_bytes);
            let surface = Surface {
                quads: most - 6,
                layout,
                resolution_m: 0.5,
                corner_m: [0.0; 3],
                size: [1; 3],
                least: [0; 3],
                most: [1; 3],
                crs: None,
            };
            let spool = || Spool::new(folder.path()).unwrap();
            let (vertices, indices, bytes) = (spool(), spool(), Vec::new());
            let mut mesh = Mesh { vertices, indices, bytes, colour_heights_m: None, surface };
            mesh.add(&brick, [0; 3], [0; 3]).unwrap();
            assert_eq!(mesh.surface.quads, most);
            let error = mesh.add(&brick, [0; 3], [0; 3]).unwrap_err().to_string();
            assert!(error.contains("4 GiB") && error.contains("choose a region"), "{error}");
            assert_eq!(mesh.surface.quads, most);
        }
    }

    #[test]
    fn faces_separate_occupied_from_other_voxels() {
        // Clusters around brick borders, also below zero, with a free voxel among them.
        let mut rows = Vec::new();
        for x in -35..35 {
            for y in [-33, -32, -1, 0, 1, 31, 32] {
                for z in -2..34 {
                    let [a, b, c] = [x, y, z].map(i64::from);
                    let mixed = (a * 73_856_093) ^ (b * 19_349_663) ^ (c * 83_492_791);
                    if mixed & 3 != 0 || y == 0 {
                        rows.push(row([x, y, z], if mixed & 31 == 5 { 0.3 } else { 0.9 }));
                    }
                }
            }
        }
        let occupied: HashSet<[i64; 3]> =
            rows.iter().filter(|row| row.probability > 0.5).map(|row| row.index.map(i64::from)).collect();
        let mut expected = HashSet::new();
        for voxel in &occupied {
            for axis in 0..3 {
                for side in [-1, 1] {
                    let (mut neighbor, mut normal) = (*voxel, [0; 3]);
                    neighbor[axis] += side;
                    normal[axis] = side;
                    if !occupied.contains(&neighbor) {
                        expected.insert((std::array::from_fn(|k| 2 * voxel[k] + 1 + normal[k]), normal));
                    }
                }
            }
        }
        for is_quantized in [false, true] {
            let found = faces(&rows, is_quantized);
            assert_eq!(found.len(), expected.len());
            assert_eq!(found.into_iter().collect::<HashSet<_>>(), expected);
        }
    }

    #[test]
    fn faces_have_the_colours_of_their_voxels() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.glb");
        // Two voxels in different bricks, which hide one face of each other, and one without a colour.
        let mut rows = [row([31, 0, 0], 0.9), row([32, 0, 0], 0.9), row([0, 0, 9], 0.9)];
        rows[0].layers.colour = Some([0, 188, 255]);
        rows[1].layers.colour = Some([1, 2, 3]);
        let layers = voxtile::Layers { colour: true, ..voxtile::Layers::NONE };
        for (is_quantized, stride) in [(false, 20), (true, 16)] {
            let head = VoxelsHead { layers, ..head_of(&rows) };
            let options = WriteOptions { is_quantized, ..WriteOptions::for_path(&path) };
            let mut sink = Box::new(GlbSink::create(&head, &path, &options).unwrap());
            rows.iter().for_each(|row| sink.put(row).unwrap());
            sink.finish().unwrap();
            let bytes = std::fs::read(&path).unwrap();
            let json_bytes = u32::from_le_bytes(bytes[12..16].try_into().unwrap()) as usize;
            let json: serde_json::Value = serde_json::from_slice(&bytes[20..20 + json_bytes]).unwrap();
            let accessor = &json["accessors"][1];
            let of_colour = (&accessor["byteOffset"], &accessor["componentType"]);
            assert_eq!(of_colour, (&(stride - 8).into(), &5123.into()));
            assert_eq!(json["bufferViews"][0]["byteStride"], stride);
            let count = accessor["count"].as_u64().unwrap() as usize;
            assert_eq!(count, 4 * (5 + 5 + 6));
            let start = 20 + json_bytes + 8 + stride - 8;
            let mut counts = std::collections::BTreeMap::new();
            for vertex in 0..count {
                let at = start + vertex * stride;
                let channel =
                    |k: usize| u16::from_le_bytes(bytes[at + 2 * k..at + 2 * k + 2].try_into().unwrap());
                *counts.entry([0, 1, 2, 3].map(channel)).or_insert(0) += 1;
            }
            let linear = |colour: [u8; 3]| {
                let [red, green, blue] = colour.map(linear_of_srgb);
                [red, green, blue, u16::MAX]
            };
            let expected = [(linear([0, 188, 255]), 20), (linear([1, 2, 3]), 20), (linear(GRAY), 24)];
            assert_eq!(counts, expected.into_iter().collect());
        }
    }
}
