use super::options::WriteOptions;
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use super::stream_out::StreamOut;
use super::{Error, Result};
use std::io::Write;
use voxtile::Layers;

/// Maximum distance of voxels from the origin of a PCD file along an axis, in voxels. Within it, `f32` represents
/// centers to an eighth of a voxel. More distant voxels are refused.
pub const PCD_REACH_VOXELS: i32 = 1 << 21;

/// Writer of binary PCD 0.7 as read by PCL: x y z as F4, intensity F4 with the probability, observation_count I4; with
/// layers `intensity` is the mean intensity, and `rgb` and `label` follow. The origin is stored as `VIEWPOINT`.
pub(super) struct PcdSink<'a> {
    out: StreamOut<'a>,
    resolution_m: f64,
    layers: Layers,
}

impl<'a> PcdSink<'a> {
    pub(super) fn new(head: &VoxelsHead, out: Box<dyn Write + 'a>, options: &WriteOptions) -> Result<Self> {
        let (&VoxelsHead { voxels, resolution_m, layers, .. }, [x, y, z]) = (head, options.origin_m);
        let origin = match options.origin_m {
            [0.0, 0.0, 0.0] => String::new(),
            _ => format!("# origin {x} {y} {z} m: to be added to x y z, as VIEWPOINT says, too\n"),
        };
        // PCL packs a colour into the bits of a float. The field `intensity` has the probability, or the mean intensity.
        let (mut names, mut sizes, mut types, mut counts) =
            (String::new(), String::new(), String::new(), String::new());
        for (is_there, name, size, kind) in
            [(layers.colour, " rgb", " 4", " F"), (layers.class, " label", " 4", " U")]
        {
            if is_there {
                names += name;
                sizes += size;
                types += kind;
                counts += " 1";
            }
        }
        let text = format!(
            "# .PCD v0.7 - occupied voxels, edge {resolution_m} m\n{origin}VERSION 0.7\nFIELDS x y z intensity \
             observation_count{names}\nSIZE 4 4 4 4 4{sizes}\nTYPE F F F F I{types}\nCOUNT 1 1 1 1 1{counts}\nWIDTH {voxels}\nHEIGHT 1\n\
             VIEWPOINT {x} {y} {z} 1 0 0 0\nPOINTS {voxels}\nDATA binary\n"
        );
        let mut out = StreamOut::new(&options.final_path, out);
        out.write(text.as_bytes())?;
        Ok(Self { out, resolution_m, layers })
    }
}

impl VoxelSink for PcdSink<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let [x, y, z] = voxel.center_m;
        let reach_m = f64::from(PCD_REACH_VOXELS) * self.resolution_m;
        if let Some(far) = voxel.center_m.iter().find(|coordinate| coordinate.abs() > reach_m) {
            let reason = format!(
                "{far} m from the file's origin, float32 coordinates are too coarse for voxels of {} m: set a closer \
                 `origin`",
                self.resolution_m
            );
            return Err(Error::argument("origin", reason));
        }
        let mut record = [0; 20];
        let RowLayers { colour, class, .. } = voxel.layers;
        let intensity = voxel.layers.intensity_or_probability(&self.layers, voxel.probability);
        let numbers = [x, y, z, intensity].map(|number| (number as f32).to_le_bytes());
        record[..16].copy_from_slice(numbers.as_flattened());
        record[16..].copy_from_slice(&voxel.observation_count.to_le_bytes());
        self.out.write(&record)?;
        if self.layers.colour {
            let [red, green, blue] = colour.unwrap_or_default();
            self.out.write(&[blue, green, red, 0])?;
        }
        if self.layers.class {
            self.out.write(&u32::from(class.unwrap_or_default()).to_le_bytes())?;
        }
        Ok(())
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
