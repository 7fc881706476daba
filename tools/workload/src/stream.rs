use std::io::{self, BufRead, Read, Write};
use voxtile::Scan;
use voxtile::space::Point;

/// Writes scans to a stream, rounded to `f32`, and their intensities to another where one is given.
#[derive(Debug)]
pub struct ScanWriter<W> {
    scans: W,
    intensities: Option<W>,
}

/// Reads what a [`ScanWriter`] wrote, as an iterator over scans.
#[derive(Debug)]
pub struct ScanReader<R> {
    scans: R,
    intensities: Option<R>,
}

/// Room made at once for the points of a scan: the count in a damaged stream may be any.
const MAX_RESERVED: usize = 1 << 20;

impl<W: Write> ScanWriter<W> {
    /// A writer to the stream of scans and, if wanted, that of intensities.
    pub fn new(scans: W, intensities: Option<W>) -> Self {
        Self { scans, intensities }
    }

    /// Adds a scan.
    ///
    /// # Errors
    ///
    /// More points than a `u32` counts, not one intensity a point where intensities are wanted, a stream that refuses.
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
            _ => Err(invalid("the scan has not one intensity a point")),
        }
    }

    /// Hands everything on to what the streams lead to.
    ///
    /// # Errors
    ///
    /// A stream that refuses.
    pub fn flush(&mut self) -> io::Result<()> {
        self.scans.flush()?;
        self.intensities.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl<R: BufRead> ScanReader<R> {
    /// A reader of the stream of scans and, if there is one, that of intensities.
    pub fn new(scans: R, intensities: Option<R>) -> Self {
        Self { scans, intensities }
    }

    fn read(&mut self) -> io::Result<Option<Scan>> {
        if self.scans.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let ends = |error| whole(error, "the stream of scans ends within a scan; write it anew");
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

/// Three `f32`, widened.
fn read_point(input: &mut impl Read) -> io::Result<Point> {
    Ok([f64::from(read_f32(input)?), f64::from(read_f32(input)?), f64::from(read_f32(input)?)])
}

fn read_f32(input: &mut impl Read) -> io::Result<f32> {
    let mut bytes = [0; 4];
    input.read_exact(&mut bytes)?;
    Ok(f32::from_le_bytes(bytes))
}

/// The error, or what the end of a stream in the middle of something means.
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
    fn what_is_written_is_read_rounded_to_f32() {
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
    fn a_scan_without_intensities_is_refused_where_they_are_wanted() {
        let scan = Scan { points: vec![[1.0; 3]], ..Scan::default() };
        assert!(ScanWriter::new(Vec::new(), Some(Vec::new())).write(&scan).is_err());
        ScanWriter::new(Vec::new(), None).write(&scan).unwrap();
    }
}
