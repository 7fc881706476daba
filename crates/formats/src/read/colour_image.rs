use super::gray16::MAX_DECODER_BYTES;
use super::input_file::open_input;
use super::regular::check_regular;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use voxtile::{FormatError, Result};

/// PNG image with the colours of a depth image, read row by row.
pub(super) struct ColourImage {
    path: PathBuf,
    reader: png::Reader<BufReader<File>>,
    /// Bytes per pixel: 1 or 2 for grey, 3 or 4 for colours.
    pixel_bytes: usize,
    row: u32,
}

impl ColourImage {
    /// Opens an image, which must have the size of the depth image.
    ///
    /// # Errors
    ///
    /// The image cannot be read, is interlaced, or has another size.
    pub(super) fn open(path: &Path, depth_path: &Path, depth_size: (u32, u32)) -> Result<Self> {
        check_regular(path)?;
        let wrong = |reason: String| FormatError::at_offset(0, reason).in_input(path);
        let input = BufReader::with_capacity(1 << 16, open_input(path)?);
        let mut decoder = png::Decoder::new_with_limits(input, png::Limits { bytes: MAX_DECODER_BYTES });
        decoder.set_ignore_text_chunk(true);
        decoder.set_ignore_iccp_chunk(true);
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let reader = decoder.read_info().map_err(|error| wrong(error.to_string()))?;
        let (width, height) = (reader.info().width, reader.info().height);
        if (width, height) != depth_size {
            return Err(wrong(format!(
                "has {width} x {height} pixels, but the depth image {} has {} x {}: colours are read pixel for pixel; \
                 register the images to each other, or build the map without colours",
                depth_path.display(),
                depth_size.0,
                depth_size.1
            )));
        }
        if reader.info().interlaced {
            return Err(wrong("is interlaced: save it without interlacing".to_owned()));
        }
        let pixel_bytes = reader.output_color_type().0.samples();
        Ok(Self { path: path.to_owned(), reader, pixel_bytes, row: 0 })
    }

    /// Replaces `colours` by those of the next row.
    pub(super) fn next_row(&mut self, colours: &mut Vec<[u8; 3]>) -> Result<()> {
        let row = self.row;
        self.row += 1;
        let damaged = |reason: String| {
            FormatError::at_record(u64::from(row), format!("row {row}: {reason}")).in_input(&self.path)
        };
        let pixels = match self.reader.next_row() {
            Ok(Some(pixels)) => pixels,
            Ok(None) => return Err(damaged("it is missing".to_owned())),
            Err(error) => return Err(damaged(error.to_string())),
        };
        colours.clear();
        colours.extend(pixels.data().chunks_exact(self.pixel_bytes.max(1)).map(|pixel| match *pixel {
            [red, green, blue, ..] => [red, green, blue],
            [grey, ..] => [grey; 3],
            [] => [0; 3],
        }));
        Ok(())
    }
}
