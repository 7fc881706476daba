use super::Result;
use super::options::WriteOptions;
use super::row::{RowLayers, VoxelRow, VoxelSink, VoxelsHead};
use super::stream_out::StreamOut;
use std::io::Write;
use voxtile::Layers;

/// Writer of CSV with a header line. Every number can be parsed back to the same bits.
pub(super) struct CsvSink<'a> {
    out: StreamOut<'a>,
    layers: Layers,
}

impl<'a> CsvSink<'a> {
    pub(super) fn new(head: &VoxelsHead, out: Box<dyn Write + 'a>, options: &WriteOptions) -> Result<Self> {
        let mut out = StreamOut::new(&options.final_path, out);
        out.write(b"x,y,z,probability,log_odds,observation_count")?;
        let layers = head.layers;
        for (is_there, columns) in [
            (layers.colour, ",red,green,blue"),
            (layers.intensity_max.is_some(), ",intensity"),
            (layers.class, ",class"),
            (layers.time, ",first_time_ns,last_time_ns"),
        ] {
            out.write(if is_there { columns } else { "" }.as_bytes())?;
        }
        out.write(b"\n")?;
        Ok(Self { out, layers })
    }
}

impl VoxelSink for CsvSink<'_> {
    fn put(&mut self, voxel: &VoxelRow) -> Result<()> {
        let VoxelRow { center_m: [x, y, z], probability, log_odds, observation_count, .. } = voxel;
        write!(self.out, "{x},{y},{z},{probability},{log_odds},{observation_count}")?;
        // A value that the voxel does not have is empty.
        let RowLayers { colour, intensity, class, time_ns, .. } = voxel.layers;
        if self.layers.colour {
            match colour {
                Some([red, green, blue]) => write!(self.out, ",{red},{green},{blue}")?,
                None => write!(self.out, ",,,")?,
            }
        }
        let text = |number: Option<f64>| number.map_or(String::new(), |number| number.to_string());
        if self.layers.intensity_max.is_some() {
            write!(self.out, ",{}", text(intensity))?;
        }
        if self.layers.class {
            write!(self.out, ",{}", text(class.map(f64::from)))?;
        }
        if self.layers.time {
            match time_ns {
                Some([first, last]) => write!(self.out, ",{first},{last}")?,
                None => write!(self.out, ",,")?,
            }
        }
        writeln!(self.out)
    }

    fn finish(self: Box<Self>) -> Result<()> {
        self.out.finish()
    }
}
