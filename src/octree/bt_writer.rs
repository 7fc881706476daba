use super::Octree;
use std::io;
pub fn write_bt(_t: &Octree, _r: f64, _th: f32, _o: &mut impl io::Write) -> io::Result<()> { Ok(()) }
