use super::image::Image;
use super::measure::Type;
use super::palette::{Rgb, mixed};
use super::theme::Theme;
use super::typeface;

/// Pixels with alpha, row by row from the top. Drawing outside is clipped.
pub struct Canvas {
    width: usize,
    height: usize,
    bytes: Vec<u8>,
}

impl Canvas {
    pub fn new(width: usize, height: usize, theme: &Theme) -> Self {
        let [red, green, blue] = theme.ground;
        let pixel = if theme.is_transparent { [0; 4] } else { [red, green, blue, 255] };
        Self { width, height, bytes: pixel.repeat(width * height) }
    }

    pub fn width(&self) -> usize {
        self.width
    }

    #[cfg(test)]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Blends a color over a box of pixels; `cover` is the opacity from 0 to 1.
    pub fn fill(&mut self, left: usize, top: usize, size: [usize; 2], color: Rgb, cover: f64) {
        let columns = left.min(self.width)..left.saturating_add(size[0]).min(self.width);
        let [red, green, blue] = color;
        for y in top.min(self.height)..top.saturating_add(size[1]).min(self.height) {
            let row = y * self.width;
            if cover >= 1.0 {
                let pixels = &mut self.bytes[4 * (row + columns.start)..4 * (row + columns.end)];
                pixels.as_chunks_mut().0.fill([red, green, blue, 255]);
            } else {
                columns.clone().for_each(|x| self.blend(x + row, color, cover));
            }
        }
    }

    /// Blends a color over the pixel at an index.
    fn blend(&mut self, place: usize, color: Rgb, cover: f64) {
        let Some(pixel) = self.bytes.get_mut(4 * place..4 * place + 4) else { return };
        let below = f64::from(pixel[3]) / 255.0;
        let alpha = cover + below * (1.0 - cover);
        if alpha <= 0.0 {
            return;
        }
        let new =
            if cover >= 1.0 { color } else { mixed([pixel[0], pixel[1], pixel[2]], color, cover / alpha) };
        pixel[..3].copy_from_slice(&new);
        pixel[3] = (255.0 * alpha).round() as u8;
    }

    /// Blends a color over a pixel that may be outside.
    pub fn dot(&mut self, [x, y]: [i64; 2], color: Rgb, cover: f64) {
        if let (Ok(x), Ok(y)) = (usize::try_from(x), usize::try_from(y))
            && x < self.width
            && y < self.height
        {
            self.blend(x + y * self.width, color, cover);
        }
    }

    /// Draws a filled disc around the center of a pixel.
    pub fn disc(&mut self, middle: [usize; 2], radius: usize, color: Rgb) {
        for dy in 0..=2 * radius {
            let up = dy as f64 - radius as f64;
            let half = ((radius as f64 + 0.3).powi(2) - up * up).max(0.0).sqrt() as usize;
            let Some(y) = (middle[1] + dy).checked_sub(radius) else { continue };
            let left = middle[0].saturating_sub(half);
            self.fill(left, y, [middle[0] + half + 1 - left, 1], color, 1.0);
        }
    }

    /// Draws the trajectory: a disc around each pixel with a rim, visible on any color.
    pub fn path(&mut self, middles: impl Iterator<Item = [usize; 2]>, radius: usize, color: Rgb, rim: Rgb) {
        let middles: Vec<[usize; 2]> = middles.collect();
        // Draw all rims first, so that close discs form one line.
        for (radius, color) in [(radius + usize::from(radius > 0) + radius / 2, rim), (radius, color)] {
            middles.iter().for_each(|&middle| self.disc(middle, radius, color));
        }
    }

    /// Draws a straight line with smooth borders. Positions count from the upper left corner of the image; pixel centers
    /// are at halves.
    pub fn line(&mut self, [from, to]: [[f64; 2]; 2], width: f64, color: Rgb, cover: f64) {
        let along = [to[0] - from[0], to[1] - from[1]];
        let length = along[0].hypot(along[1]);
        if !length.is_finite() || length == 0.0 {
            return;
        }
        let major = usize::from(along[1].abs() > along[0].abs());
        let slope = along[1 - major] / along[major];
        // Distance of the borders from the middle of the line, along the minor axis.
        let half = (0.5 * width + 1.0) * slope.hypot(1.0);
        let limit = [self.width, self.height].map(|size| size as f64);
        let range = |low: f64, high: f64, axis: usize| {
            let [low, high] = [low.floor(), high.ceil()].map(|k| k.clamp(0.0, limit[axis]));
            low as i64..high as i64
        };
        let [start, end] = [from[major].min(to[major]), from[major].max(to[major])];
        for step in range(start - 0.5 * width, end + 0.5 * width, major) {
            let middle = from[1 - major] + (step as f64 + 0.5 - from[major]) * slope;
            for side in range(middle - half, middle + half, 1 - major) {
                let at = if major == 0 { [step, side] } else { [side, step] };
                let [x, y] = std::array::from_fn(|k| at[k] as f64 + 0.5 - from[k]);
                let share = ((x * along[0] + y * along[1]) / length.powi(2)).clamp(0.0, 1.0);
                let distance = (x - share * along[0]).hypot(y - share * along[1]);
                self.dot(at, color, cover * (0.5 * width + 0.5 - distance).clamp(0.0, 1.0));
            }
        }
    }

    /// Writes text from the left end of its base line, at the height of the top of its capitals.
    pub fn text(&mut self, left: usize, top: usize, size: Type, color: Rgb, text: &str) {
        let (left, base) = (left as i64, (top + size.height()) as i64);
        typeface::rasterize(text, size.size_px, |[x, y], cover| {
            self.dot([left + i64::from(x), base + i64::from(y)], color, cover);
        });
    }

    /// Writes text that ends at a column.
    pub fn text_before(&mut self, right: usize, top: usize, size: Type, color: Rgb, text: &str) {
        self.text(right.saturating_sub(size.width_of(text)), top, size, color, text);
    }

    pub fn into_image(self, dpi: f64) -> Image {
        Image::new(self.width, self.height, self.bytes, dpi)
    }
}

#[cfg(test)]
mod tests {
    use super::super::theme::Background;
    use super::*;

    #[test]
    fn drawing_outside_is_clipped() {
        let mut canvas = Canvas::new(4, 3, &Theme::of(Background::Black));
        canvas.fill(3, 2, [10, 10], [9; 3], 1.0);
        canvas.fill(usize::MAX, 0, [2, 2], [9; 3], 1.0);
        canvas.disc([0, 0], 2, [7; 3]);
        canvas.text(2, 1, Type { size_px: 30.0 }, [0; 3], "10 m");
        for end in [[1e9, 1e9], [-1e300, 3.0], [f64::NAN; 2], [1.0, 2.0]] {
            canvas.line([[1.0, 2.0], end], 0.0, [0; 3], 1.0);
        }
        let image = canvas.into_image(300.0);
        assert_eq!(image.rgba().len(), 48);
        assert_eq!(image.pixel(0, 0), Some([7; 3]));
        assert!(image.rgba().chunks(4).all(|pixel| pixel[3] == 255));
    }

    #[test]
    fn lines_are_as_wide_as_said_in_any_direction() {
        for turn in 0..16 {
            let mut canvas = Canvas::new(100, 100, &Theme::of(Background::Black));
            let (up, right) = (f64::from(turn) * 0.4).sin_cos();
            let ends = [-1.0, 1.0].map(|end| [50.0 + 40.0 * end * right, 50.0 + 40.0 * end * up]);
            canvas.line(ends, 3.0, [250; 3], 1.0);
            let image = canvas.into_image(300.0);
            let area = image.rgba().chunks(4).map(|pixel| f64::from(pixel[0])).sum::<f64>() / 250.0;
            // With round ends.
            assert!((area - 247.0).abs() < 6.0, "{turn}: {area}");
        }
    }

    #[test]
    fn a_transparent_ground_takes_colors_with_their_alpha() {
        let mut canvas = Canvas::new(3, 1, &Theme::of(Background::Transparent));
        canvas.fill(0, 0, [2, 1], [200, 100, 0], 0.5);
        canvas.fill(1, 0, [1, 1], [0, 100, 200], 0.5);
        let image = canvas.into_image(300.0);
        assert_eq!(image.rgba(), [200, 100, 0, 128, 67, 100, 133, 192, 0, 0, 0, 0]);
    }
}
