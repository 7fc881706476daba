use super::glb::Surface;
use serde_json::{Value, json};

/// Returns the JSON header of a glTF file: one mesh, its buffer and its position in the world.
///
/// Vertices are integer voxel coordinates, exact in single precision. The scale and translation of the node, in double
/// precision, convert them to metres.
pub(super) fn of(surface: &Surface) -> Value {
    let asset =
        json!({ "version": "2.0", "generator": concat!("voxtile-clouds ", env!("CARGO_PKG_VERSION")) });
    if surface.quads == 0 {
        return json!({ "asset": asset, "scene": 0, "scenes": [{}] });
    }
    let (vertices, indices) = (4 * surface.quads, 6 * surface.quads);
    let is_short = surface.layout.is_short;
    let (stride, component) = (surface.layout.bytes() as u64, if is_short { 5123 } else { 5126 });
    let colour_component = if surface.layout.is_coloured { 5123 } else { 5121 };
    let resolution_m = surface.resolution_m;
    let [x, y, z] = surface.corner_m;
    let mut head = json!({
        "asset": asset,
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{
            "name": "voxels",
            "mesh": 0,
            "scale": [resolution_m, resolution_m, resolution_m],
            // In glTF, y is up and z is the map's -y.
            "translation": [x, z, -(y + surface.size[1] as f64 * resolution_m)],
            "extras": {
                "origin_m": [x, y, z],
                "resolution_m": resolution_m,
                "crs": surface.crs,
            },
        }],
        "meshes": [{
            "primitives": [{ "attributes": { "POSITION": 0, "COLOR_0": 1 }, "indices": 2, "material": 0 }],
        }],
        "materials": [{
            "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        }],
        "accessors": [
            {
                "bufferView": 0,
                "componentType": component,
                "count": vertices,
                "type": "VEC3",
                "min": surface.least,
                "max": surface.most,
            },
            {
                "bufferView": 0,
                "byteOffset": surface.layout.position_bytes(),
                "componentType": colour_component,
                "normalized": true,
                "count": vertices,
                "type": "VEC4",
            },
            { "bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteLength": vertices * stride, "byteStride": stride, "target": 34962 },
            { "buffer": 0, "byteOffset": vertices * stride, "byteLength": indices * 4, "target": 34963 },
        ],
        "buffers": [{ "byteLength": vertices * stride + indices * 4 }],
    });
    if is_short && let Some(members) = head.as_object_mut() {
        members.insert("extensionsUsed".to_owned(), json!(["KHR_mesh_quantization"]));
        members.insert("extensionsRequired".to_owned(), json!(["KHR_mesh_quantization"]));
    }
    head
}
