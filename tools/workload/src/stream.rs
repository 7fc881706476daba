use std::io::{self, BufRead, Read, Write};
use voxtile::Scan;
use voxtile::space::Point;

/// Writes scans to a stream, rounded to `f32`, and optionally their intensities to another.
#[derive(Debug)]
pub struct ScanWriter<W> {
    scans: W,
    intensities: Option<W>,
}

/// Iterator over the scans that a [`ScanWriter`] wrote.
#[derive(Debug)]
pub struct ScanReader<R> {
    scans: R,
    intensities: Option<R>,
}

/// Maximum number of points to reserve memory for: the count may be wrong in a damaged stream.
const MAX_RESERVED: usize = 1 << 20;

impl<W: Write> ScanWriter<W> {
    /// Creates a writer of scans and, optionally, intensities.
    pub fn new(scans: W, intensities: Option<W>) -> Self {
        Self { scans, intensities }
    }

    /// Writes a scan.
    ///
    /// # Errors
    ///
    /// Fails if the scan has more points than a `u32` counts, if an intensity per point is needed and missing, or if a
    /// stream cannot be written.
    pub fn write(&mut self, scan: &Scan) -> io::Result<()> {
        let count =
            u32::try_from(scan.points.len()).map_err(|_| invalid("a scan of more than 2^32 - 1 points"))?;
        self.scans.write_all(&count.to_le_bytes())?;
        for number in scan.origin.iter().chain(scan.points.iter().flatten()) {
            self.scans.write_all(&(*number as f32).to_le_bytes())?;
        }
        let Some(out) = &mut self.intensities else { return Ok(()) };
        match &scan.intensities {
            Some(intensities) if intensities.len() == scan.points.len() => {
                intensities.iter().try_for_each(|intensity| out.write_all(&intensity.to_le_bytes()))
            }
            _ => Err(invalid("the scan needs one intensity per point")),
        }
    }

    /// Flushes the streams.
    ///
    /// # Errors
    ///
    /// Fails if a stream cannot be written.
    pub fn flush(&mut self) -> io::Result<()> {
        self.scans.flush()?;
        self.intensities.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl<R: BufRead> ScanReader<R> {
    /// Creates a reader of scans and, optionally, intensities.
    pub fn new(scans: R, intensities: Option<R>) -> Self {
        Self { scans, intensities }
    }

    fn read(&mut self) -> io::Result<Option<Scan>> {
        if self.scans.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let ends = |error| whole(error, "the stream of scans ends within a scan; write it again");
        let mut count = [0; 4];
        self.scans.read_exact(&mut count).map_err(ends)?;
        let count = u32::from_le_bytes(count) as usize;
        let origin = read_point(&mut self.scans).map_err(ends)?;
        let mut points = Vec::with_capacity(count.min(MAX_RESERVED));
        for _ in 0..count {
            points.push(read_point(&mut self.scans).map_err(ends)?);
        }
        let Some(input) = &mut self.intensities else {
            return Ok(Some(Scan { origin, points, intensities: None }));
        };
        let intensities = (0..count).map(|_| read_f32(input)).collect::<io::Result<_>>();
        let intensities = intensities
            .map_err(|error| whole(error, "fewer intensities than points; write both streams at once"))?;
        Ok(Some(Scan { origin, points, intensities: Some(intensities) }))
    }
}

impl<R: BufRead> Iterator for ScanReader<R> {
    type Item = io::Result<Scan>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

/// Reads three `f32` as `f64`.
fn read_point(input: &mut impl Read) -> io::Result<Point> {
    Ok([f64::from(read_f32(input)?), f64::from(read_f32(input)?), f64::from(read_f32(input)?)])
}

fn read_f32(input: &mut impl Read) -> io::Result<f32> {
    let mut bytes = [0; 4];
    input.read_exact(&mut bytes)?;
    Ok(f32::from_le_bytes(bytes))
}

/// Replaces an unexpected end of the stream by an error with this meaning.
fn whole(error: io::Error, meaning: &'static str) -> io::Error {
    if error.kind() == io::ErrorKind::UnexpectedEof { io::Error::new(error.kind(), meaning) } else { error }
}

fn invalid(what: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, what)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::SurveyName;

    fn written(scans: &[Scan]) -> [Vec<u8>; 2] {
        let (mut points, mut intensities) = (Vec::new(), Vec::new());
        let mut writer = ScanWriter::new(&mut points, Some(&mut intensities));
        scans.iter().for_each(|scan| writer.write(scan).unwrap());
        [points, intensities]
    }

    fn rounded(scan: &Scan) -> Scan {
        let round = |point: &Point| point.map(|x| f64::from(x as f32));
        Scan {
            origin: round(&scan.origin),
            points: scan.points.iter().map(round).collect(),
            intensities: scan.intensities.clone(),
        }
    }

    #[test]
    fn written_scans_are_read_back_rounded_to_f32() {
        let scans: Vec<Scan> = SurveyName::Indoor.scans(3, 5, SurveyName::RAYS).take(2).collect();
        let [points, intensities] = written(&scans);
        let read: io::Result<Vec<Scan>> = ScanReader::new(&points[..], Some(&intensities[..])).collect();
        assert_eq!(read.unwrap(), scans.iter().map(rounded).collect::<Vec<_>>());
        let bare = ScanReader::new(&points[..], None).next().unwrap().unwrap();
        assert_eq!(bare, Scan { intensities: None, ..rounded(&scans[0]) });
    }

    #[test]
    fn a_stream_that_ends_anywhere_within_a_scan_is_an_error() {
        let scan = Scan {
            origin: [1.0, 2.0, 3.0],
            points: vec![[4.0; 3], [5.0; 3]],
            intensities: Some(vec![7.0; 2]),
        };
        let [points, intensities] = written(&[scan]);
        for end in 1..points.len() {
            let read = ScanReader::new(&points[..end], None).next();
            assert!(read.is_some_and(|scan| scan.is_err()), "after {end} bytes");
        }
        assert!(ScanReader::new(&points[..], Some(&intensities[..7])).next().unwrap().is_err());
        assert!(ScanReader::new(&points[..0], None).next().is_none());
    }

    #[test]
    fn a_scan_without_required_intensities_is_refused() {
        let scan = Scan { points: vec![[1.0; 3]], ..Scan::default() };
        assert!(ScanWriter::new(Vec::new(), Some(Vec::new())).write(&scan).is_err());
        ScanWriter::new(Vec::new(), None).write(&scan).unwrap();
    }
}
