/// Message types with raw sensor packets or compressed clouds: package, type and the program that converts them to
/// clouds.
const DRIVERS: [(&str, &str, &str); 12] = [
    ("velodyne_msgs", "VelodyneScan", "velodyne_pointcloud"),
    ("ouster_ros", "PacketMsg", "ouster_ros"),
    ("ouster_sensor_msgs", "PacketMsg", "ouster_ros"),
    ("ouster_msgs", "PacketMsg", "ouster_ros"),
    ("rslidar_msgs", "", "rslidar_pointcloud"),
    ("rslidar_msg", "", "rslidar_sdk"),
    ("hesai_lidar", "PandarScan", "hesai_lidar"),
    ("pandar_msgs", "", "the driver of Hesai"),
    ("hesai_ros_driver", "UdpFrame", "hesai_ros_driver"),
    ("nebula_msgs", "", "nebula_ros"),
    ("point_cloud_interfaces", "CompressedPointCloud2", "point_cloud_transport (republish)"),
    ("stereo_msgs", "DisparityImage", "stereo_image_proc"),
];

/// Returns the program that converts messages of this type to clouds, if known.
pub(in crate::ros) fn driver_of(type_name: &str) -> Option<&'static str> {
    let words: Vec<&str> = type_name.split(['/', ':']).filter(|word| !word.is_empty()).collect();
    let (package, name) = (*words.first()?, words.last()?.trim_end_matches('_'));
    let known = DRIVERS.iter().find(|(of, kind, _)| *of == package && (kind.is_empty() || *kind == name));
    known.map(|(_, _, driver)| *driver)
}
