/// Serializer of ROS messages.
pub struct MessageWriter {
    bytes: Vec<u8>,
    is_cdr: bool,
}

/// Type codes of `sensor_msgs/PointField`.
pub const U32: u8 = 6;
pub const F32: u8 = 7;
pub const F64: u8 = 8;

/// Point field: name, byte offset, type.
pub type Field = (&'static str, u32, u8);

/// Point layout as declared in a cloud message.
#[derive(Clone, Copy)]
pub struct CloudLayout {
    /// Height and width.
    pub size: [u32; 2],
    pub is_big_endian: bool,
    pub point_step: u32,
    pub row_step: u32,
}

impl MessageWriter {
    /// Starts a ROS 1 message: little-endian, without padding.
    pub fn ros1() -> Self {
        Self { bytes: Vec::new(), is_cdr: false }
    }

    /// Starts a ROS 2 message: numbers are aligned to their size, after a four-byte CDR header.
    pub fn cdr() -> Self {
        Self { bytes: vec![0, 1, 0, 0], is_cdr: true }
    }

    /// Writes a number, given as its little-endian bytes.
    pub fn number<const N: usize>(mut self, bytes: [u8; N]) -> Self {
        while self.is_cdr && !self.bytes.len().wrapping_sub(4).is_multiple_of(N) {
            self.bytes.push(0);
        }
        self.bytes.extend(bytes);
        self
    }

    pub fn u32(self, number: u32) -> Self {
        self.number(number.to_le_bytes())
    }

    pub fn f32s(self, numbers: &[f32]) -> Self {
        numbers.iter().fold(self, |message, number| message.number(number.to_le_bytes()))
    }

    pub fn f64s(self, numbers: &[f64]) -> Self {
        numbers.iter().fold(self, |message, number| message.number(number.to_le_bytes()))
    }

    /// Writes length-prefixed bytes.
    pub fn sized(self, bytes: &[u8]) -> Self {
        let mut message = self.u32(bytes.len() as u32);
        message.bytes.extend(bytes);
        message
    }

    pub fn text(self, text: &str) -> Self {
        match self.is_cdr {
            true => self.sized(&[text.as_bytes(), &[0]].concat()),
            false => self.sized(text.as_bytes()),
        }
    }

    /// Writes a `std_msgs/Header`.
    pub fn header(self, stamp_ns: i64, frame: &str) -> Self {
        let message = if self.is_cdr { self } else { self.u32(0) };
        let (seconds, ns) = (stamp_ns / 1_000_000_000, stamp_ns % 1_000_000_000);
        message.u32(seconds as u32).u32(ns as u32).text(frame)
    }

    /// Writes a `sensor_msgs/PointCloud2` with one row.
    pub fn point_cloud2(self, stamp_ns: i64, frame: &str, fields: &[Field], points: &[Vec<u8>]) -> Vec<u8> {
        let (step, data) = (points.first().map_or(1, Vec::len), points.concat());
        let layout = CloudLayout {
            size: [1, points.len() as u32],
            is_big_endian: false,
            point_step: step as u32,
            row_step: data.len() as u32,
        };
        self.header(stamp_ns, frame).cloud_data(&layout, fields, &data)
    }

    /// Writes the part of a `sensor_msgs/PointCloud2` after its header.
    pub fn cloud_data(self, layout: &CloudLayout, fields: &[Field], data: &[u8]) -> Vec<u8> {
        let [height, width] = layout.size;
        let message = self.u32(height).u32(width).u32(fields.len() as u32);
        let message = fields.iter().fold(message, |message, &(name, offset, kind)| {
            // A field with this name contains all three coordinates.
            let count = if name == "xyz" { 3 } else { 1 };
            message.text(name).u32(offset).number([kind]).u32(count)
        });
        let message = message.number([u8::from(layout.is_big_endian)]).u32(layout.point_step);
        message.u32(layout.row_step).sized(data).number([1]).done()
    }

    /// Writes a `sensor_msgs/CameraInfo` of a camera without distortion: fx, fy, cx, cy.
    pub fn camera(self, stamp_ns: i64, frame: &str, [fx, fy, cx, cy]: [f64; 4]) -> Vec<u8> {
        let message = self.header(stamp_ns, frame).u32(1).u32(1).text("plumb_bob").u32(0);
        let message = message.f64s(&[fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]);
        // R, P, binning and the region of interest are ignored by the reader.
        message.f64s(&[0.0; 9 + 12]).u32(0).u32(0).f64s(&[0.0; 3]).done()
    }

    /// Writes a `sensor_msgs/Image` from raw pixels, row by row.
    pub fn image(self, stamp_ns: i64, frame: &str, encoding: &str, width: u32, pixels: &[u8]) -> Vec<u8> {
        let pixel_bytes = if encoding.starts_with("32") { 4 } else { 2 };
        let (step, height) = (width * pixel_bytes, pixels.len() as u32 / (width * pixel_bytes));
        let message = self.header(stamp_ns, frame).u32(height).u32(width).text(encoding).number([0]);
        message.u32(step).sized(pixels).done()
    }

    /// Writes a `sensor_msgs/CompressedImage`.
    pub fn compressed_image(self, stamp_ns: i64, frame: &str, format: &str, data: &[u8]) -> Vec<u8> {
        self.header(stamp_ns, frame).text(format).sized(data).done()
    }

    /// Writes a `nav_msgs/Odometry` without velocities.
    pub fn odometry(self, stamp_ns: i64, parent: &str, child: &str, numbers: &[f64; 7]) -> Vec<u8> {
        let message = self.header(stamp_ns, parent).text(child).f64s(numbers);
        message.f64s(&[0.0; 36 + 6 + 36]).done()
    }

    /// Writes a `tf2_msgs/TFMessage` with one transform: a translation and a quaternion x y z w.
    pub fn tf(self, stamp_ns: i64, parent: &str, child: &str, numbers: &[f64; 7]) -> Vec<u8> {
        self.u32(1).header(stamp_ns, parent).text(child).f64s(numbers).done()
    }

    pub fn done(self) -> Vec<u8> {
        self.bytes
    }
}
