use super::grid::{Grid, Steps};
use super::pinhole::Pinhole;
use super::planes::{BlockInput, PlaneReader, PlaneWriter};
use super::words::{Width, unzigzag, zigzag};
use crate::error::FormatError;
use std::io;
use std::sync::Arc;

/// Encoding of a column's values as words.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Form {
    /// Bit patterns of the values.
    Bits(Width),
    /// Differences from the value a given number of points before.
    Differences(Width, u8),
    /// For values of which most are multiples of a step: differences between consecutive multiples. A second list
    /// contains the deviations of values from their multiples, in units in the last place, a third one the values that
    /// are on no multiple.
    Steps(Width, Grid),
    /// For coordinates of a depth image: differences between each pixel and its prediction.
    Pixels(Arc<Pinhole>),
}

const BITS: u8 = 0;
const DIFFERENCES: u8 = 1;
const STEPS: u8 = 2;
const PARTS: u8 = 3;
const PIXELS: u8 = 4;
const UNIT_STEPS: u8 = 5;
const UNIT_PARTS: u8 = 6;
const IS_WIDE: u8 = 0x80;

/// Distances in the list between points with similar values: 1 for neighbours; 2 and 4 for sensors whose beams fire in
/// turn.
const LAGS: [u8; 3] = [1, 2, 4];
/// Number of sampled values by which the form of a column is chosen.
const SAMPLE_SIZE: usize = 1 << 14;
/// Number of consecutive blocks that reuse a form before other forms are tried again.
const BLOCKS_ALIKE: u32 = 32;
/// Deviation that stands for a value that is on no multiple of a step.
const OFF_GRID: i8 = i8::MIN;
/// One in this many values at most may be off the grid.
const MIN_VALUES_PER_OFF_GRID: usize = 16;
/// Number of columns whose forms are remembered.
const COLUMNS: usize = 4;

#[derive(Default)]
pub(super) struct ColumnWriter {
    planes: PlaneWriter,
    words: Vec<u64>,
    apart: Vec<u8>,
    off_grid: Vec<u64>,
    sample: Vec<u8>,
    /// Form of each column's last block, and the number of blocks before it with the same form.
    chosen: [Option<(Form, u32)>; COLUMNS],
}

impl ColumnWriter {
    /// Appends the column with index `column` of its block. `depths` are the z values for the columns x and y, which
    /// the camera form needs.
    pub(super) fn put(
        &mut self,
        column: usize,
        values: &[f64],
        depths: Option<&[f64]>,
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        // Blocks of one sensor are similar: the form of the last block is tried first.
        let chosen = self.chosen[column % COLUMNS].take();
        if let Some((form, blocks)) = chosen.filter(|(_, blocks)| *blocks < BLOCKS_ALIKE)
            && self.put_form(values, depths, &form, out)?
        {
            self.chosen[column % COLUMNS] = Some((form, blocks + 1));
            return Ok(());
        }
        let width = Width::of(values);
        let camera = depths.filter(|_| width == Width::Wide).and_then(|z| Pinhole::of(values, z));
        let form = match camera {
            Some(camera) => Form::Pixels(Arc::new(camera)),
            None => self.choose(values, width, true)?,
        };
        if self.put_form(values, depths, &form, out)? {
            self.chosen[column % COLUMNS] = Some((form, 0));
            return Ok(());
        }
        // Some values do not fit the grid or the camera that the sample suggested. The form used instead is not
        // remembered, because the next block may fit a grid again.
        let form = self.choose(values, width, false)?;
        self.put_form(values, depths, &form, out).map(drop)
    }

    /// Appends words of so many bytes without a form.
    pub(super) fn put_words(
        &mut self,
        words: impl Iterator<Item = u64>,
        bytes: usize,
        out: &mut Vec<u8>,
    ) -> io::Result<()> {
        self.words.clear();
        self.words.extend(words);
        self.planes.put(&self.words, bytes, out)
    }

    /// Chooses the form with the smallest encoding of a sample; falls back to one that is not a grid.
    fn choose(&mut self, values: &[f64], width: Width, may_be_grid: bool) -> io::Result<Form> {
        let first = values.len().saturating_sub(SAMPLE_SIZE) / 2;
        let part = &values[first..values.len().min(first + SAMPLE_SIZE)];
        let grids = Grid::of(values, width).filter(|_| may_be_grid).map(|grid| Form::Steps(width, grid));
        let differences = LAGS.map(|lag| Form::Differences(width, lag));
        let mut best = (usize::MAX, Form::Bits(width));
        for form in grids.chain(differences).chain([Form::Bits(width)]) {
            if !self.fill_words(part, None, &form) {
                continue;
            }
            let bytes = self.size_of_sample(&form)?;
            if bytes < best.0 {
                best = (bytes, form);
            }
        }
        Ok(best.1)
    }

    /// Returns the encoded size of the sample in bytes.
    fn size_of_sample(&mut self, form: &Form) -> io::Result<usize> {
        self.sample.clear();
        let bytes = bytes_of(form, &self.words);
        self.planes.put(&self.words, bytes, &mut self.sample)?;
        if let Form::Steps(width, _) = form {
            self.planes.put_bytes(&self.apart, &mut self.sample)?;
            self.planes.put(&self.off_grid, width.bytes(), &mut self.sample)?;
        }
        Ok(self.sample.len())
    }

    /// Appends the column in a form; returns `false` if the values do not fit it.
    fn put_form(
        &mut self,
        values: &[f64],
        depths: Option<&[f64]>,
        form: &Form,
        out: &mut Vec<u8>,
    ) -> io::Result<bool> {
        if !self.fill_words(values, depths, form) {
            return Ok(false);
        }
        let bytes = bytes_of(form, &self.words);
        match form {
            &Form::Bits(width) => out.push(BITS | flag_of(width)),
            &Form::Differences(width, lag) => out.extend([DIFFERENCES | flag_of(width), lag]),
            &Form::Steps(width, grid) => {
                let is_in_metres = grid.unit == 1.0;
                let (kind, number) = match grid.steps {
                    Steps::Times(step) => (if is_in_metres { STEPS } else { UNIT_STEPS }, step),
                    Steps::Over(parts) => (if is_in_metres { PARTS } else { UNIT_PARTS }, parts),
                };
                out.push(kind | flag_of(width));
                out.extend(number.to_le_bytes());
                if !is_in_metres {
                    out.extend(grid.unit.to_le_bytes());
                }
                out.push(bytes as u8);
            }
            Form::Pixels(camera) => {
                out.push(PIXELS);
                out.extend(camera.focal.to_le_bytes());
                out.extend(camera.center.to_le_bytes());
                out.push(bytes as u8);
            }
        }
        self.planes.put(&self.words, bytes, out)?;
        if let Form::Steps(width, _) = form {
            self.planes.put_bytes(&self.apart, out)?;
            self.planes.put(&self.off_grid, width.bytes(), out)?;
        }
        Ok(true)
    }

    /// Converts values to words; returns `false` if the values do not fit the form.
    fn fill_words(&mut self, values: &[f64], depths: Option<&[f64]>, form: &Form) -> bool {
        let words = &mut self.words;
        words.clear();
        match form {
            Form::Bits(width) | Form::Differences(width, _) if !width.has(values) => return false,
            &Form::Bits(width) => words.extend(values.iter().map(|value| width.bits(*value))),
            &Form::Differences(width, lag) => {
                let ordered = |value: &f64| width.ordered(width.bits(*value));
                words.extend(values.iter().map(ordered));
                for at in (usize::from(lag)..words.len()).rev() {
                    words[at] = width.difference(words[at], words[at - usize::from(lag)]);
                }
            }
            Form::Steps(width, _) if !width.has(values) => return false,
            &Form::Steps(width, grid) => {
                self.apart.clear();
                self.off_grid.clear();
                let mut before = 0;
                for value in values {
                    let (steps, apart) = grid.place(*value, width).unwrap_or_else(|| {
                        self.off_grid.push(width.bits(*value));
                        (before, OFF_GRID)
                    });
                    words.push(zigzag(steps - before));
                    self.apart.push(apart as u8);
                    before = steps;
                }
                return self.off_grid.len() <= values.len() / MIN_VALUES_PER_OFF_GRID;
            }
            Form::Pixels(camera) => return camera.words(values, depths.unwrap_or_default(), words),
        }
        true
    }
}

fn flag_of(width: Width) -> u8 {
    if width == Width::Wide { IS_WIDE } else { 0 }
}

/// Number of significant bytes in the words of a form.
fn bytes_of(form: &Form, words: &[u64]) -> usize {
    match form {
        Form::Bits(width) | Form::Differences(width, _) => width.bytes(),
        Form::Steps(..) | Form::Pixels(_) => {
            let most = words.iter().fold(0, |all, word| all | word);
            (64 - most.leading_zeros() as usize).div_ceil(8)
        }
    }
}

#[derive(Default)]
pub(super) struct ColumnReader {
    planes: PlaneReader,
    words: Vec<u64>,
    apart: Vec<u8>,
    /// Camera of the last column that was stored as pixels.
    camera: Option<Pinhole>,
}

impl ColumnReader {
    /// Reads words that [`ColumnWriter::put_words`] wrote.
    pub(super) fn take_words(
        &mut self,
        points: usize,
        bytes: usize,
        input: &mut BlockInput<'_>,
    ) -> Result<&[u64], FormatError> {
        self.words.clear();
        self.words.resize(points, 0);
        self.planes.take(&mut self.words, bytes, input)?;
        Ok(&self.words)
    }

    /// Reads a column of `points` values; replaces the content of the list.
    pub(super) fn take(
        &mut self,
        points: usize,
        depths: Option<&[f64]>,
        values: &mut Vec<f64>,
        input: &mut BlockInput<'_>,
    ) -> Result<(), FormatError> {
        values.clear();
        self.words.clear();
        self.words.resize(points, 0);
        let kind = input.byte()?;
        let width = if kind & IS_WIDE == 0 { Width::Narrow } else { Width::Wide };
        match kind & !IS_WIDE {
            BITS => {
                self.planes.take(&mut self.words, width.bytes(), input)?;
                values.extend(self.words.iter().map(|word| width.value(*word)));
            }
            DIFFERENCES => {
                let lag = usize::from(input.byte()?);
                if lag == 0 {
                    return Err(input.wrong("differences from the value itself"));
                }
                self.planes.take(&mut self.words, width.bytes(), input)?;
                for at in lag..points {
                    self.words[at] = width.sum(self.words[at], self.words[at - lag]);
                }
                values.extend(self.words.iter().map(|word| width.value(width.unordered(*word))));
            }
            kind @ (STEPS | PARTS | UNIT_STEPS | UNIT_PARTS) => {
                let number = input.double()?;
                let is_times = matches!(kind, STEPS | UNIT_STEPS);
                let steps = if is_times { Steps::Times(number) } else { Steps::Over(number) };
                let unit = if matches!(kind, STEPS | PARTS) { 1.0 } else { input.double()? };
                let grid = Grid { steps, unit };
                let bytes = word_bytes(input)?;
                self.planes.take(&mut self.words, bytes, input)?;
                self.apart.clear();
                self.apart.resize(points, 0);
                self.planes.take_bytes(&mut self.apart, input)?;
                let mut steps = 0_i64;
                values.extend(self.words.iter().zip(&self.apart).map(|(word, apart)| {
                    steps = steps.wrapping_add(unzigzag(*word));
                    grid.value_at(steps, *apart as i8, width)
                }));
                // Blocks of version 1 have no such values.
                let is_off = |apart: &u8| *apart as i8 == OFF_GRID;
                let off_grid = self.apart.iter().filter(|apart| is_off(apart)).count();
                if off_grid > 0 {
                    self.words.truncate(off_grid);
                    self.planes.take(&mut self.words, width.bytes(), input)?;
                    let places = values.iter_mut().zip(&self.apart);
                    let off = places.filter(|(_, apart)| is_off(apart));
                    off.zip(&self.words).for_each(|((value, _), bits)| *value = width.value(*bits));
                }
            }
            PIXELS => {
                let (focal, center) = (input.double()?, input.double()?);
                let is_same = |camera: &Pinhole| (camera.focal, camera.center) == (focal, center);
                let camera = match self.camera.take().filter(is_same) {
                    Some(camera) => camera,
                    None => Pinhole::new(focal, center),
                };
                let bytes = word_bytes(input)?;
                self.planes.take(&mut self.words, bytes, input)?;
                let depths = depths.ok_or_else(|| input.wrong("pixels without depths"))?;
                camera.values(&self.words, depths, values);
                self.camera = Some(camera);
            }
            _ => return Err(input.wrong("a column of unknown form")),
        }
        Ok(())
    }
}

pub(super) fn word_bytes(input: &mut BlockInput<'_>) -> Result<usize, FormatError> {
    match usize::from(input.byte()?) {
        bytes @ 0..=8 => Ok(bytes),
        _ => Err(input.wrong("values of more than eight bytes")),
    }
}
