// Prints the points of a PCD file as read by PCL: `x y z intensity`, after the viewpoint.
#include <cstdio>
#include <pcl/io/pcd_io.h>
#include <pcl/point_types.h>

int main(int argc, char **argv) {
    pcl::PCLPointCloud2 raw;
    pcl::PointCloud<pcl::PointXYZI> cloud;
    Eigen::Vector4f origin;
    Eigen::Quaternionf orientation;
    int version;
    pcl::PCDReader reader;
    if (argc != 2 || reader.read(argv[1], raw, origin, orientation, version) < 0) return 1;
    if (pcl::io::loadPCDFile(argv[1], cloud) < 0) return 1;
    std::printf("# origin %.9g %.9g %.9g\n", origin[0], origin[1], origin[2]);
    for (const auto &p : cloud) std::printf("%.9g %.9g %.9g %.9g\n", p.x, p.y, p.z, p.intensity);
}
