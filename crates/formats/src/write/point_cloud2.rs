/// Message definition for recordings, followed by the definitions of the nested messages.
pub(super) const SCHEMA: &str = "\
std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
================================================================================
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
================================================================================
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
================================================================================
MSG: sensor_msgs/PointField
uint8 INT8=1
uint8 UINT8=2
uint8 INT16=3
uint8 UINT16=4
uint8 INT32=5
uint8 UINT32=6
uint8 FLOAT32=7
uint8 FLOAT64=8
string name
uint32 offset
uint8 datatype
uint32 count
";

/// Type of a point field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum FieldType {
    Int32,
    UInt32,
    Float32,
    Float64,
}

impl FieldType {
    fn number(self) -> u8 {
        match self {
            Self::Int32 => 5,
            Self::UInt32 => 6,
            Self::Float32 => 7,
            Self::Float64 => 8,
        }
    }

    pub(super) fn bytes(self) -> u32 {
        match self {
            Self::Int32 | Self::UInt32 | Self::Float32 => 4,
            Self::Float64 => 8,
        }
    }
}

/// Encoder of a ROS 2 message: little-endian CDR. Alignment counts from after the first four bytes.
struct Cdr(Vec<u8>);

impl Cdr {
    fn align(&mut self, to: usize) {
        while !(self.0.len() - 4).is_multiple_of(to) {
            self.0.push(0);
        }
    }

    fn u32(&mut self, number: u32) {
        self.align(4);
        self.0.extend(number.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }
}

/// Encodes an unorganised cloud. Fields are packed without gaps, and `points` contains whole points.
pub(super) fn encode(stamp_ns: u64, frame: &str, fields: &[(&str, FieldType)], points: &[u8]) -> Vec<u8> {
    let step: u32 = fields.iter().map(|(_, of)| of.bytes()).sum();
    let mut cdr = Cdr(Vec::with_capacity(points.len() + 512));
    cdr.0.extend([0, 1, 0, 0]);
    // Seconds are a signed 32-bit number, valid until 2038; later stamps wrap as in ROS.
    cdr.u32((stamp_ns / 1_000_000_000) as u32);
    cdr.u32((stamp_ns % 1_000_000_000) as u32);
    cdr.text(frame);
    cdr.u32(1);
    cdr.u32((points.len() / step.max(1) as usize) as u32);
    cdr.u32(fields.len() as u32);
    let mut offset = 0;
    for (name, of) in fields {
        cdr.text(name);
        cdr.u32(offset);
        cdr.0.push(of.number());
        cdr.u32(1);
        offset += of.bytes();
    }
    cdr.0.push(0);
    cdr.u32(step);
    cdr.u32(points.len() as u32);
    cdr.u32(points.len() as u32);
    cdr.0.extend(points);
    cdr.0.push(1);
    cdr.0
}
