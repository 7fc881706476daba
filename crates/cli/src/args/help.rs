//! Help texts that several commands share.

pub const MAP: &str = "Folder of the map";
pub const MAP_TO_WRITE: &str = "Folder of the map; no other process may be writing to it";
pub const MAP_OR_SNAPSHOT: &str = "Folder of the map, or FOLDER@SNAPSHOT";
pub const ANY_MAP: &str = "Folder of the map, FOLDER@SNAPSHOT, or an OctoMap file (.bt .ot)";
pub const MAP_WITH_SCANS: &str = "Folder of a map that keeps its scans (build --keep-scans)";
pub const NEW_MAP: &str = "Folder of the new map; must not exist yet";
pub const JSON: &str = "Print the result as JSON";
pub const STORAGE: &str = "Storage format of the tiles of the new map";
pub const COLOR: &str = "Value shown by color";
pub const MAX_HEIGHT: &str = "Draw only voxels below this height, in metres, or none. By default views from above cut the \
                              ceiling of rooms: at the height of the sensor, if most columns around the trajectory \
                              are roofed";
pub const VOXELS_IN_BOX: &str =
    "Only voxels whose center is in this box (X0 <= x < X1, same for y and z), in metres";
pub const MEMORY: &str = "Memory budget for everything that grows with the map or with a scan, such as 256MiB or 1GB; \
                          about 40 MB more are always used [default: 512MiB, or the minimum for this tile size]";
pub const KEEP_AS: &str = "Keep the current state of the map as a snapshot of this name first";
pub const MIN_RANGE: &str = "Skip points nearer to the sensor than this, in metres";
pub const CALIB: &str = "KITTI's calib.txt, for poses of the camera such as KITTI's own";
pub const EXTRINSIC: &str = "Pose of the sensor in the body frame of the poses: tx ty tz qx qy qz qw, or a 3x4 matrix \
                             row by row";
pub const POSE_TOLERANCE: &str = "Maximum time from a scan to the nearest pose, in seconds; poses are interpolated \
                                  over gaps of up to twice this time";
pub const RESOLUTION: &str = "Edge length of a voxel, in metres";
macro_rules! scans {
    ($more:literal) => {
        concat!(
            "Scans: a folder of point clouds in the sensor's frame (PCD, PLY, LAS, KITTI .bin, depth images), or one \
             with a subfolder scans/; a recording (.bag .mcap .db3, rosbag2 folder); a file (.laz .e57 .xyz ...); OctoMap's \
             .graph or .log; ",
            $more,
            "a scan stream (.scans, or - for standard input). Several are read in this order; neighbouring files of \
             clouds of one format and folder are one input, as the folder would be"
        )
    };
}
pub const SCANS: &str = scans!("");
pub const SCANS_OR_MAP: &str = scans!("a map that keeps its scans; ");
