use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{self, Write};
use voxtile_render::Image;

/// Colors of a picture in sixels.
const MAX_COLORS: usize = 256;

/// Sixels: bands of six rows, each color of a band by itself. A hundred lines; the crates for it bring quantizers of
/// photographs, which these few flat colors do not need.
pub fn write(image: &Image, out: &mut impl Write) -> io::Result<()> {
    let palette = Palette::of(image);
    let (width, height) = (image.width_px(), image.height_px());
    write!(out, "\x1bP0;1;0q\"1;1;{width};{height}")?;
    for (number, color) in palette.colors.iter().enumerate() {
        let [red, green, blue] = color.map(|value| (u32::from(value) * 100 + 127) / 255);
        write!(out, "#{number};2;{red};{green};{blue}")?;
    }
    for top in (0..height).step_by(6) {
        // By color: of each column, which of the six rows have it.
        let mut rows: BTreeMap<usize, Vec<u8>> = BTreeMap::new();
        for y in top..height.min(top + 6) {
            for x in 0..width {
                let number = palette.number_of(image.pixel(x, y).unwrap_or_default());
                rows.entry(number).or_insert_with(|| vec![0; width])[x] |= 1 << (y - top);
            }
        }
        for (number, columns) in rows {
            write!(out, "#{number}{}$", packed(&columns))?;
        }
        write!(out, "-")?;
    }
    writeln!(out, "\x1b\\")
}

/// The characters of a band, repeats counted.
fn packed(columns: &[u8]) -> String {
    let mut text = String::new();
    for run in columns.chunk_by(|a, b| a == b) {
        let letter = char::from(63 + run[0]);
        // A string takes all that is written to it.
        let _ = match run.len() {
            1..=3 => write!(text, "{}", letter.to_string().repeat(run.len())),
            count => write!(text, "!{count}{letter}"),
        };
    }
    text
}

/// Few colors for many: those that agree in their upper bits share their mean.
struct Palette {
    bits: u32,
    numbers: BTreeMap<[u8; 3], usize>,
    colors: Vec<[u8; 3]>,
}

impl Palette {
    fn of(image: &Image) -> Self {
        let mut counts: BTreeMap<[u8; 3], u64> = BTreeMap::new();
        for pixel in image.rgba().chunks_exact(4) {
            *counts.entry([pixel[0], pixel[1], pixel[2]]).or_default() += 1;
        }
        let groups = |bits: u32| {
            let mut groups: BTreeMap<[u8; 3], ([u64; 3], u64)> = BTreeMap::new();
            for (&color, &count) in &counts {
                let (sums, members) = groups.entry(upper(color, bits)).or_default();
                (0..3).for_each(|k| sums[k] += count * u64::from(color[k]));
                *members += count;
            }
            groups
        };
        // Two bits a channel leave 64 colors at most.
        let (bits, groups) = (2..=8)
            .rev()
            .map(|bits| (bits, groups(bits)))
            .find(|(_, groups)| groups.len() <= MAX_COLORS)
            .unwrap_or_default();
        let numbers = groups.keys().copied().zip(0..).collect();
        let mean = |(sums, members): ([u64; 3], u64)| sums.map(|sum| (sum / members.max(1)) as u8);
        Self { bits, numbers, colors: groups.into_values().map(mean).collect() }
    }

    fn number_of(&self, color: [u8; 3]) -> usize {
        self.numbers.get(&upper(color, self.bits)).copied().unwrap_or_default()
    }
}

fn upper(color: [u8; 3], bits: u32) -> [u8; 3] {
    color.map(|value| value >> (8 - bits.clamp(1, 8)))
}
