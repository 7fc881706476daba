use crate::error::FormatError;
use crate::space::Point;
pub(in crate::store) const MOST_POINTS: usize = 65_536;
#[derive(Debug, Default)]
pub(in crate::store) struct PointEncoder {}
impl PointEncoder {
    pub(in crate::store) fn encode(
        &mut self,
        points: &[Point],
        intensities: Option<&[f32]>,
        out: &mut Vec<u8>,
    ) {
        out.push(intensities.is_some().into());
        for p in points {
            for x in p {
                out.extend(x.to_le_bytes());
            }
        }
        for i in intensities.unwrap_or_default() {
            out.extend(i.to_le_bytes());
        }
    }
}
#[derive(Debug, Default)]
pub(in crate::store) struct PointDecoder {}
impl PointDecoder {
    pub(in crate::store) fn decode(
        &mut self,
        block: &[u8],
        points: &mut Vec<Point>,
        intensities: &mut Vec<f32>,
    ) -> Result<bool, FormatError> {
        let Some((&flag, rest)) = block.split_first() else { return Err(FormatError::at_offset(0, "empty")) };
        let has = flag != 0;
        let n = rest.len() / if has { 28 } else { 24 };
        for p in rest[..24 * n].chunks_exact(24) {
            points.push(std::array::from_fn(|k| {
                f64::from_le_bytes(p[8 * k..8 * k + 8].try_into().unwrap_or_default())
            }));
        }
        for i in rest[24 * n..].chunks_exact(4) {
            intensities.push(f32::from_le_bytes(i.try_into().unwrap_or_default()));
        }
        Ok(has)
    }
}
