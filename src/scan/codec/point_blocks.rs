use super::{MAX_POINTS, PointEncoder};
use crate::error::{Error, Result};
use crate::scan::{AttributeSlices, PointAttributes};
use crate::space::Point;
use std::path::Path;

/// Encoder of scans as blocks of points. It reuses its memory between scans.
#[derive(Debug, Default)]
pub struct PointBlocks {
    encoder: PointEncoder,
    points: Vec<Point>,
    intensities: Vec<f32>,
    attributes: PointAttributes,
    block: Vec<u8>,
}

/// Callback that receives an encoded block.
type Put<'a> = dyn FnMut(&[u8]) -> Result<()> + 'a;

impl PointBlocks {
    /// Begins a scan, and discards the rest of an abandoned one.
    pub fn begin(&mut self) {
        self.points.clear();
        self.intensities.clear();
        self.attributes.clear();
    }

    /// Adds points to the scan, all with the same kinds of attributes; passes each full block to `put`.
    ///
    /// # Errors
    ///
    /// Returns errors from `put`, and fails if memory is exhausted.
    pub fn push(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
        attributes: AttributeSlices<'_>,
        put: &mut Put<'_>,
    ) -> Result<()> {
        let mut at = 0;
        while at < points.len() {
            let count = (points.len() - at).min(MAX_POINTS - self.points.len());
            if count == MAX_POINTS {
                // A full block is encoded without a copy.
                let some = at..at + count;
                let intensities = intensities.map(|all| &all[some.clone()]);
                self.encode(&points[some.clone()], intensities, attributes.part(some), put)?;
            } else {
                self.points.extend_from_slice(&points[at..at + count]);
                self.intensities.extend_from_slice(intensities.map_or(&[], |all| &all[at..at + count]));
                self.attributes.extend(attributes.part(at..at + count));
                if self.points.len() == MAX_POINTS {
                    self.end(intensities.is_some(), put)?;
                }
            }
            at += count;
        }
        Ok(())
    }

    /// Ends the scan with a block of the remaining points.
    ///
    /// # Errors
    ///
    /// Same errors as [`PointBlocks::push`].
    pub fn end(&mut self, has_intensities: bool, put: &mut Put<'_>) -> Result<()> {
        if self.points.is_empty() {
            return Ok(());
        }
        let (points, intensities) = (std::mem::take(&mut self.points), std::mem::take(&mut self.intensities));
        let attributes = std::mem::take(&mut self.attributes);
        let all = attributes.part(0..points.len());
        let ended = self.encode(&points, has_intensities.then_some(&*intensities), all, put);
        // Put the lists back, so that the next scan reuses their memory.
        (self.points, self.intensities, self.attributes) = (points, intensities, attributes);
        self.begin();
        ended
    }

    fn encode(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
        attributes: AttributeSlices<'_>,
        put: &mut Put<'_>,
    ) -> Result<()> {
        self.block.clear();
        let encoded = self.encoder.encode(points, intensities, attributes, &mut self.block);
        encoded.map_err(|error| Error::io(Path::new("the points of a scan"), "compress", error))?;
        put(&self.block)
    }
}
