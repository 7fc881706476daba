// Writes small maps with the OctoMap library: the fixtures in tests/data/octomap_1.
//
//   fixtures OUT_FOLDER

#include <octomap/OcTree.h>
#include <octomap/ScanGraph.h>

#include <cmath>
#include <cstdint>
#include <string>

namespace {

// Generates the same numbers on every machine.
class Random {
public:
    double between(double low, double high) {
        state_ = state_ * 6364136223846793005u + 1442695040888963407u;
        return low + (high - low) * static_cast<double>(state_ >> 40) / static_cast<double>(1u << 24);
    }

private:
    std::uint64_t state_ = 7;
};

// Points seen from a sensor in a room with wavy walls.
octomap::Pointcloud scan(Random& random, int points) {
    octomap::Pointcloud cloud;
    for (int k = 0; k < points; ++k) {
        const double azimuth = random.between(0.0, 6.283185307), up = random.between(-0.9, 0.9);
        const double reach = 2.0 + std::cos(3.0 * azimuth) + 0.5 * std::sin(9.0 * up);
        const double flat = std::sqrt(1.0 - up * up) * reach;
        cloud.push_back(static_cast<float>(flat * std::cos(azimuth)), static_cast<float>(flat * std::sin(azimuth)),
                        static_cast<float>(up * reach));
    }
    return cloud;
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) return 2;
    const std::string folder = std::string(argv[1]) + "/";
    Random random;
    octomap::ScanGraph graph;
    octomap::OcTree lazy(0.2), pruned(0.25);
    for (int number = 0; number < 3; ++number) {
        const octomap::pose6d pose(1.5 * number, -0.5 * number, 0.3, 0.0, 0.1 * number, 0.7 * number);
        const octomap::Pointcloud cloud = scan(random, 150);
        graph.addNode(new octomap::Pointcloud(cloud), pose);
        lazy.insertPointCloud(cloud, octomap::point3d(0, 0, 0), pose, -1.0, true);
        pruned.insertPointCloud(cloud, octomap::point3d(0, 0, 0), pose);
    }
    lazy.updateInnerOccupancy();
    // A fully known block, so that there is something to prune.
    for (int x = 0; x < 16; ++x)
        for (int y = 0; y < 16; ++y)
            for (int z = 0; z < 8; ++z)
                pruned.updateNode(octomap::point3d(-3.1f + 0.2f * x, 3.3f + 0.2f * y, 0.1f + 0.2f * z), z < 4);
    pruned.prune();
    lazy.prune();
    bool is_written = pruned.write(folder + "block.ot") && pruned.writeBinary(folder + "block.bt");
    is_written &= lazy.writeBinary(folder + "room.bt");
    octomap::OcTree one(0.05);
    one.updateNode(octomap::point3d(-1, 2, -3), true);
    is_written &= one.writeBinary(folder + "one_voxel.bt");
    return is_written && graph.writeBinary(folder + "three_scans.graph") ? 0 : 1;
}
