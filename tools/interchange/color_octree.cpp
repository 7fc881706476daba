// Reads a .ot file as OctoMap's ColorOcTree and prints its voxels, `x y z log_odds red green blue`, in unspecified
// order. Writes the tree to AGAIN as it is, and to AVERAGED with inner nodes computed by OctoMap.
//
//   color_octree FILE AGAIN AVERAGED
#include <cstdio>
#include <memory>
#include <octomap/ColorOcTree.h>

int main(int argc, char **argv) {
    if (argc != 4) return 1;
    std::unique_ptr<octomap::AbstractOcTree> any(octomap::AbstractOcTree::read(argv[1]));
    auto *tree = dynamic_cast<octomap::ColorOcTree *>(any.get());
    if (!tree) return 1;
    if (!tree->write(argv[2])) return 1;
    tree->updateInnerOccupancy();
    if (!tree->write(argv[3])) return 1;
    tree->expand();
    for (auto leaf = tree->begin_leafs(); leaf != tree->end_leafs(); ++leaf) {
        const auto p = leaf.getCoordinate();
        const auto c = leaf->getColor();
        std::printf("%.9g %.9g %.9g %.9g %d %d %d\n", p.x(), p.y(), p.z(), leaf->getLogOdds(), c.r, c.g, c.b);
    }
}
