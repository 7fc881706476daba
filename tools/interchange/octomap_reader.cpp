// Prints the centers of the occupied voxels of a .bt or .ot file as read by OctoMap: `x y z`, in unspecified order.
#include <cstdio>
#include <cstring>
#include <memory>
#include <octomap/octomap.h>

int main(int argc, char **argv) {
    if (argc != 2) return 1;
    std::unique_ptr<octomap::OcTree> tree;
    const char *extension = std::strrchr(argv[1], '.');
    if (extension && !std::strcmp(extension, ".bt")) {
        tree.reset(new octomap::OcTree(1.0));
        if (!tree->readBinary(argv[1])) return 1;
    } else {
        tree.reset(dynamic_cast<octomap::OcTree *>(octomap::AbstractOcTree::read(argv[1])));
        if (!tree) return 1;
    }
    tree->expand();
    for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf)
        if (tree->isNodeOccupied(*leaf)) {
            const auto p = leaf.getCoordinate();
            std::printf("%.9g %.9g %.9g\n", p.x(), p.y(), p.z());
        }
}
