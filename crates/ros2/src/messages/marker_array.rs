use super::sequence;
use super::{Header, Pose, Time};
use serde::Serialize;

/// `std_msgs/ColorRGBA`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Color {
    pub r: f32,
    pub g: f32,
    pub b: f32,
    pub a: f32,
}

/// `visualization_msgs/Marker` since Humble.
#[derive(Clone, Debug, Serialize)]
pub struct Marker {
    pub header: Header,
    pub ns: String,
    pub id: i32,
    kind: i32,
    action: i32,
    pose: Pose,
    /// Metres.
    pub scale: [f64; 3],
    pub color: Color,
    lifetime: Time,
    frame_locked: bool,
    /// Metres.
    pub points: Vec<[f64; 3]>,
    pub colors: Vec<Color>,
    texture_resource: String,
    texture: CompressedImage,
    uv_coordinates: Vec<[f32; 2]>,
    text: String,
    mesh_resource: String,
    mesh_file: MeshFile,
    mesh_use_embedded_materials: bool,
}

/// `sensor_msgs/CompressedImage`.
#[derive(Clone, Debug, Default, Serialize)]
struct CompressedImage {
    header: Header,
    format: String,
    #[serde(with = "sequence")]
    data: Vec<u8>,
}

/// `visualization_msgs/MeshFile`.
#[derive(Clone, Debug, Default, Serialize)]
struct MeshFile {
    filename: String,
    #[serde(with = "sequence")]
    data: Vec<u8>,
}

/// `visualization_msgs/MarkerArray`.
#[derive(Clone, Debug, Serialize)]
pub struct MarkerArray {
    pub markers: Vec<Marker>,
}

const CUBE: i32 = 1;
const SPHERE: i32 = 2;
const CUBE_LIST: i32 = 6;
const ADD: i32 = 0;
const DELETE: i32 = 2;
const DELETE_ALL: i32 = 3;

impl Color {
    /// Returns an opaque color.
    pub fn of_bytes(colour: [u8; 3]) -> Self {
        let [r, g, b] = colour.map(|value| f32::from(value) / 255.0);
        Self { r, g, b, a: 1.0 }
    }
}

impl Marker {
    /// Returns cubes of one size and color. Without cubes, the marker deletes the previous ones.
    pub fn of_cubes(header: Header, edge_m: f64, color: Color, centers_m: Vec<[f64; 3]>) -> Self {
        let action = if centers_m.is_empty() { DELETE } else { ADD };
        let cubes = Self { scale: [edge_m; 3], color, points: centers_m, ..Self::empty(header) };
        Self { ns: "map".to_owned(), kind: CUBE_LIST, action, ..cubes }
    }

    /// Returns a cube.
    pub fn cube(header: Header, size_m: [f64; 3], color: Color, center_m: [f64; 3]) -> Self {
        Self { kind: CUBE, scale: size_m, color, pose: Pose::at(center_m), ..Self::empty(header) }
    }

    /// Returns a sphere.
    pub fn sphere(header: Header, size_m: [f64; 3], color: Color, center_m: [f64; 3]) -> Self {
        Self { kind: SPHERE, ..Self::cube(header, size_m, color, center_m) }
    }

    /// Returns the marker with a name, by which a later one replaces it.
    pub fn named(self, ns: &str, id: i32) -> Self {
        Self { ns: ns.to_owned(), id, ..self }
    }

    /// Returns a marker that deletes all previous ones of the topic.
    pub fn that_deletes_all(header: Header) -> Self {
        Self { action: DELETE_ALL, ..Self::empty(header) }
    }

    fn empty(header: Header) -> Self {
        Self {
            header,
            ns: String::new(),
            id: 0,
            kind: 0,
            action: ADD,
            pose: Pose::at([0.0; 3]),
            scale: [0.0; 3],
            color: Color::of_bytes([0; 3]),
            lifetime: Time::default(),
            frame_locked: false,
            points: Vec::new(),
            colors: Vec::new(),
            texture_resource: String::new(),
            texture: CompressedImage::default(),
            uv_coordinates: Vec::new(),
            text: String::new(),
            mesh_resource: String::new(),
            mesh_file: MeshFile::default(),
            mesh_use_embedded_materials: false,
        }
    }
}
