use super::{MAX_POINTS, PointEncoder};
use crate::error::{Error, Result};
use crate::space::Point;
use std::path::Path;

/// Makes blocks of the points of scans. It keeps its memory from scan to scan.
#[derive(Debug, Default)]
pub struct PointBlocks {
    encoder: PointEncoder,
    /// Points of the block that is being filled.
    points: Vec<Point>,
    intensities: Vec<f32>,
    block: Vec<u8>,
}

/// Takes a block.
type Put<'a> = dyn FnMut(&[u8]) -> Result<()> + 'a;

impl PointBlocks {
    /// Begins a scan. What is left of one that was given up is forgotten.
    pub fn begin(&mut self) {
        self.points.clear();
        self.intensities.clear();
    }

    /// Adds points to the scan, all with intensities or all without; `put` takes each block that is full.
    ///
    /// # Errors
    ///
    /// Those of `put`; no memory to compress a block.
    pub fn push(&mut self, points: &[Point], intensities: Option<&[f32]>, put: &mut Put<'_>) -> Result<()> {
        let mut at = 0;
        while at < points.len() {
            let count = (points.len() - at).min(MAX_POINTS - self.points.len());
            if count == MAX_POINTS {
                // A whole block need not be copied.
                let some = at..at + count;
                self.encode(&points[some.clone()], intensities.map(|all| &all[some]), put)?;
            } else {
                self.points.extend_from_slice(&points[at..at + count]);
                self.intensities.extend_from_slice(intensities.map_or(&[], |all| &all[at..at + count]));
                if self.points.len() == MAX_POINTS {
                    self.end(intensities.is_some(), put)?;
                }
            }
            at += count;
        }
        Ok(())
    }

    /// Ends the scan with the block of the points that are left.
    ///
    /// # Errors
    ///
    /// As for [`PointBlocks::push`].
    pub fn end(&mut self, has_intensities: bool, put: &mut Put<'_>) -> Result<()> {
        if self.points.is_empty() {
            return Ok(());
        }
        let (points, intensities) = (std::mem::take(&mut self.points), std::mem::take(&mut self.intensities));
        let ended = self.encode(&points, has_intensities.then_some(&*intensities), put);
        // Their memory serves again.
        (self.points, self.intensities) = (points, intensities);
        self.begin();
        ended
    }

    fn encode(&mut self, points: &[Point], intensities: Option<&[f32]>, put: &mut Put<'_>) -> Result<()> {
        self.block.clear();
        let encoded = self.encoder.encode(points, intensities, &mut self.block);
        encoded.map_err(|error| Error::io(Path::new("the points of a scan"), "compress", error))?;
        put(&self.block)
    }
}
