use super::Header;
use super::sequence;
use serde::Serialize;

/// `sensor_msgs/PointField`.
#[derive(Clone, Debug, Serialize)]
pub struct PointField {
    pub name: String,
    pub offset: u32,
    pub datatype: u8,
    pub count: u32,
}

/// `sensor_msgs/PointCloud2`.
#[derive(Clone, Debug, Serialize)]
pub struct PointCloud2 {
    pub header: Header,
    pub height: u32,
    pub width: u32,
    pub fields: Vec<PointField>,
    pub is_bigendian: bool,
    pub point_step: u32,
    pub row_step: u32,
    #[serde(with = "sequence")]
    pub data: Vec<u8>,
    pub is_dense: bool,
}

const FLOAT32: u8 = 7;
const UINT8: u8 = 2;
const STEP: u32 = 12;
/// Bytes per point of clouds with the field `state`, padded to alignment.
const STEP_WITH_STATE: u32 = 16;
/// Bytes per point of clouds with a further number or a colour.
const STEP_WITH_VALUE: u32 = 16;

impl PointCloud2 {
    /// Returns a cloud in single precision, which all readers of ROS clouds support.
    pub fn of_points(header: Header, points_m: impl IntoIterator<Item = [f64; 3]>) -> Self {
        let coordinates = points_m.into_iter().flatten();
        let data = coordinates.flat_map(|value| (value as f32).to_le_bytes()).collect();
        Self::of_data(header, position_fields().to_vec(), STEP, data)
    }

    /// Returns a cloud with an additional field `rgb`, packed as in PCL.
    pub fn of_colours(header: Header, points: impl IntoIterator<Item = ([f64; 3], [u8; 3])>) -> Self {
        let mut data = Vec::new();
        for (point_m, colour) in points {
            data.extend(point_m.into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            data.extend(packed(colour));
        }
        let mut fields = position_fields().to_vec();
        fields.push(rgb_field(STEP));
        Self::of_data(header, fields, STEP_WITH_VALUE, data)
    }

    /// Returns a cloud with an additional field `state`.
    pub fn of_states(header: Header, points: impl IntoIterator<Item = ([f64; 3], u8)>) -> Self {
        let mut data = Vec::new();
        for (point_m, state) in points {
            data.extend(point_m.into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            data.extend([state, 0, 0, 0]);
        }
        Self::of_data(header, state_fields(), STEP_WITH_STATE, data)
    }

    /// Returns a cloud with the additional fields `state` and `rgb`.
    pub fn of_coloured_states(
        header: Header,
        points: impl IntoIterator<Item = ([f64; 3], u8, [u8; 3])>,
    ) -> Self {
        let mut data = Vec::new();
        for (point_m, state, colour) in points {
            data.extend(point_m.into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            data.extend([state, 0, 0, 0]);
            data.extend(packed(colour));
        }
        let mut fields = state_fields();
        fields.push(rgb_field(STEP_WITH_STATE));
        Self::of_data(header, fields, STEP_WITH_STATE + 4, data)
    }

    /// Returns a cloud with an additional field in single precision.
    pub fn of_values(header: Header, name: &str, points: impl IntoIterator<Item = ([f64; 3], f32)>) -> Self {
        let mut data = Vec::new();
        for (point_m, value) in points {
            data.extend(point_m.into_iter().flat_map(|value| (value as f32).to_le_bytes()));
            data.extend(value.to_le_bytes());
        }
        let mut fields = position_fields().to_vec();
        fields.push(PointField { name: name.to_owned(), offset: STEP, datatype: FLOAT32, count: 1 });
        Self::of_data(header, fields, STEP_WITH_VALUE, data)
    }

    /// Returns a cloud with one byte per point. All points are equal.
    #[cfg(test)]
    pub fn of_bytes(header: Header, points: u32) -> Self {
        let field = |name: &str| PointField { name: name.to_owned(), offset: 0, datatype: UINT8, count: 1 };
        Self::of_data(header, ["x", "y", "z"].map(field).to_vec(), 1, vec![1; points as usize])
    }

    #[cfg(test)]
    pub fn cdr(&self) -> Vec<u8> {
        let body = cdr_encoding::to_vec::<_, byteorder::LittleEndian>(self).unwrap();
        [vec![0, 1, 0, 0], body].concat()
    }

    fn of_data(header: Header, fields: Vec<PointField>, point_step: u32, data: Vec<u8>) -> Self {
        let row_step = u32::try_from(data.len()).unwrap_or(u32::MAX);
        Self {
            header,
            height: 1,
            width: row_step / point_step,
            fields,
            is_bigendian: false,
            point_step,
            row_step,
            data,
            is_dense: true,
        }
    }
}

fn state_fields() -> Vec<PointField> {
    let mut fields = position_fields().to_vec();
    fields.push(PointField { name: "state".to_owned(), offset: STEP, datatype: UINT8, count: 1 });
    fields
}

fn rgb_field(offset: u32) -> PointField {
    PointField { name: "rgb".to_owned(), offset, datatype: FLOAT32, count: 1 }
}

/// Blue, green, red and 0: the bits of a little-endian `float`, as in PCL.
fn packed([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [blue, green, red, 0]
}

fn position_fields() -> [PointField; 3] {
    [("x", 0), ("y", 4), ("z", 8)].map(|(name, offset)| PointField {
        name: name.to_owned(),
        offset,
        datatype: FLOAT32,
        count: 1,
    })
}
