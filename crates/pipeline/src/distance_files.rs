use crate::output::{OutputFile, StagedOutput};
use std::path::Path;
use voxtile::{Error, Result};
use voxtile_distance::{Distance, DistanceField};
use voxtile_formats::write::{NpyArray, write_arrays};

/// Writes a distance field as NumPy arrays: `distance` in metres (NaN if unknown, infinite beyond the cap) and
/// `squared_voxels` (exact; 32766 beyond the cap, 32767 unknown), both by z, y, x; `origin`, the center of the first
/// voxel, `resolution` and `max_distance` in metres.
///
/// # Errors
///
/// The output is invalid as for [`StagedOutput::beside`], or an I/O error occurs.
pub fn write_distances_npz(field: &DistanceField, output: &Path) -> anyhow::Result<()> {
    let voxels = field.voxel_box();
    let resolution_m = field.grid().resolution_m();
    let distances = field.to_array();
    let in_metres = |distance: Distance| match distance {
        Distance::Unknown => f32::NAN,
        Distance::Within(distance_m) => distance_m as f32,
        Distance::Beyond => f32::INFINITY,
        Distance::DeepInside => f32::NEG_INFINITY,
    };
    let shape = [2, 1, 0].map(|k| (voxels.end[k] - voxels.min[k]).max(0) as usize).to_vec();
    let number = |name, value: f64| NpyArray {
        name,
        kind: "<f8",
        shape: Vec::new(),
        bytes: value.to_le_bytes().to_vec(),
    };
    let arrays = [
        NpyArray {
            name: "distance.npy",
            kind: "<f4",
            shape: shape.clone(),
            bytes: distances
                .iter()
                .flat_map(|distance| in_metres(distance.in_metres(resolution_m)).to_le_bytes())
                .collect(),
        },
        NpyArray {
            name: "squared_voxels.npy",
            kind: "<i2",
            shape,
            bytes: distances.iter().flat_map(|distance| distance.to_bits().to_le_bytes()).collect(),
        },
        NpyArray {
            name: "origin.npy",
            kind: "<f8",
            shape: vec![3],
            bytes: field.grid().center_m(voxels.min).iter().flat_map(|k| k.to_le_bytes()).collect(),
        },
        number("resolution.npy", resolution_m),
        number("max_distance.npy", field.options().max_distance_m),
    ];
    let staged = StagedOutput::beside(output)?;
    write_arrays(&staged.path()?, &arrays)?;
    staged.finish()?;
    Ok(())
}

/// Writes the lowest layer of a distance field as a 16-bit grey PNG, x to the right and y up: millimetres up to 65533,
/// 65534 beyond the cap, 65535 unknown; 0 in obstacles.
///
/// # Errors
///
/// The output is invalid as for [`OutputFile::create`], the layer is empty or too large for PNG, or an I/O error occurs.
pub fn write_distances_png(field: &DistanceField, output: &Path) -> anyhow::Result<()> {
    let voxels = field.voxel_box();
    let [width, height] = [0, 1].map(|k| (i64::from(voxels.end[k]) - i64::from(voxels.min[k])).max(0) as u32);
    if width == 0 || height == 0 {
        return Err(Error::argument("slice_z", "has no voxels in the box").into());
    }
    let resolution_m = field.grid().resolution_m();
    let pixel = |distance: Distance| match distance {
        Distance::Unknown => u16::MAX,
        Distance::Within(distance_m) => (1000.0 * distance_m).round().clamp(0.0, 65533.0) as u16,
        Distance::Beyond => u16::MAX - 1,
        Distance::DeepInside => 0,
    };
    let rows = (voxels.min[1]..voxels.end[1]).rev();
    let pixels = rows.flat_map(|y| (voxels.min[0]..voxels.end[0]).map(move |x| [x, y, voxels.min[2]]));
    let bytes: Vec<u8> =
        pixels.flat_map(|voxel| pixel(field.voxel(voxel).in_metres(resolution_m)).to_be_bytes()).collect();
    let mut file = OutputFile::create(output)?;
    let written = write_png(width, height, &bytes, file.out());
    file.written(written)?;
    file.finish()
}

fn write_png(width: u32, height: u32, bytes: &[u8], out: impl std::io::Write) -> std::io::Result<()> {
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(bytes)?;
    Ok(writer.finish()?)
}

/// Returns the box of one layer of voxels.
///
/// # Errors
///
/// The height is outside of the map's space.
pub fn layer_of(grid: &voxtile::Grid, region: voxtile::Aabb, z_m: f64) -> Result<voxtile::Aabb> {
    let Some([.., z]) = grid.voxel_of([0.0, 0.0, z_m]) else {
        return Err(Error::argument("slice_z", format!("{z_m} m is outside of the map's space")));
    };
    let (mut min, mut max) = (region.min, region.max);
    (min[2], max[2]) = (f64::from(z) * grid.resolution_m(), (f64::from(z) + 1.0) * grid.resolution_m());
    Ok(voxtile::Aabb { min, max })
}
