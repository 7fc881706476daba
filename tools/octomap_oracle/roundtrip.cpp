// Writes random trees with the OctoMap library, for voxtile to read and rewrite.
//
//   roundtrip make FOLDER COUNT   COUNT trees: n.ot, and n.expected.bt (OctoMap's writeBinary of n.ot)
//   roundtrip own FOLDER          checks that OctoMap rewrites n.ours.bt and n.ours.ot byte for byte

#include <octomap/octomap.h>

#include <fstream>
#include <iostream>
#include <memory>
#include <random>
#include <sstream>
#include <string>

using namespace octomap;

static const double RESOLUTIONS[] = {0.1,     0.05, 1e-5,      0.123456789, 12345678.9, 1.0,   0.08,
                                     5000000, 1e-4, 0.0099999995, 999999.5, 100000.5,   2.5e-7, 100.0};

static std::string bytes_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

// Adds clusters of updates, some of them whole cubes, so that pruning happens; every second tree is not pruned.
static void grow(OcTree& tree, std::mt19937& random, bool pruned) {
  auto below = [&](unsigned end) { return unsigned(random() % end); };
  unsigned clusters = below(6), kinds = below(3) ? 5 : 0;
  for (unsigned cluster = 0; cluster < clusters; ++cluster) {
    OcTreeKey base;
    for (int axis = 0; axis < 3; ++axis) base[axis] = key_type(below(65536) & ~15u);
    unsigned kind = kinds ? below(kinds) : 4, edge = 1u << below(5);
    float value = (int(below(9)) - 4) * 0.7f;
    for (unsigned x = 0; x < edge; ++x)
      for (unsigned y = 0; y < edge; ++y)
        for (unsigned z = 0; z < edge; ++z) {
          OcTreeKey key(base[0] + x, base[1] + y, base[2] + z);
          if (kind == 0) tree.setNodeValue(key, value, true);
          if (kind == 1) tree.updateNode(key, below(3) == 0, true);
          if (kind == 2) for (int i = 0; i < 8; ++i) tree.updateNode(key, value > 0, !pruned);
          if (kind == 3 && below(8) != 0) tree.setNodeValue(key, float(below(4)) * 0.4f, !pruned);
          // Cubes of 2 x 2 x 2 equal occupied voxels, each cube with another value: how much OctoMap prunes depends on
          // whether there is something to prune among the voxels.
          if (kind == 4) tree.setNodeValue(key, 1.0f + float(x / 2 + 8 * (y / 2) + 64 * (z / 2)), false);
        }
  }
  // Lazily updated trees keep stale inner values unless they are updated. Files have both kinds.
  if (below(2)) tree.updateInnerOccupancy();
  if (pruned) tree.prune();
  else if (tree.size() < 2000 && below(2) && tree.getRoot() && tree.getNumLeafNodes() < 300) {
    // One more level of unpruned equal children.
    for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it)
      if (it.getDepth() < 16 && below(2)) { tree.expandNode(&*it); break; }
  }
}

static int make(const std::string& folder, int count) {
  std::mt19937 random(20240229);
  for (int n = 0; n < count; ++n) {
    OcTree tree(RESOLUTIONS[n % (sizeof RESOLUTIONS / sizeof *RESOLUTIONS)]);
    do grow(tree, random, n % 2 == 0);
    while (!tree.getRoot());  // OctoMap cannot read the empty .ot that it writes
    std::string name = folder + "/" + std::to_string(n);
    tree.write(name + ".ot");
    std::unique_ptr<AbstractOcTree> again(AbstractOcTree::read(name + ".ot"));
    dynamic_cast<OcTree&>(*again).writeBinary(name + ".expected.bt");
  }
  return 0;
}

static int own(const std::string& folder) {
  int differing = 0, n = 0;
  for (;; ++n) {
    std::string name = folder + "/" + std::to_string(n);
    std::string bt = bytes_of(name + ".ours.bt"), ot = bytes_of(name + ".ours.ot");
    if (bt.empty() && ot.empty()) break;
    std::ostringstream bt_again, ot_again;
    OcTree tree(1.0);
    std::istringstream bt_in(bt), ot_in(ot);
    if (!tree.readBinary(bt_in) || !tree.writeBinaryConst(bt_again) || bt_again.str() != bt) {
      std::cout << name << ".ours.bt: OctoMap rewrites it differently\n";
      ++differing;
    }
    std::unique_ptr<AbstractOcTree> general(AbstractOcTree::read(ot_in));
    if (!general || !general->write(ot_again) || ot_again.str() != ot) {
      std::cout << name << ".ours.ot: OctoMap rewrites it differently\n";
      ++differing;
    }
  }
  std::cout << "OctoMap rewrites " << n << " pairs of voxtile files, " << differing << " differ\n";
  return differing != 0 || n == 0;
}

int main(int argc, char** argv) {
  std::string command = argc > 2 ? argv[1] : "";
  if (command == "make" && argc == 4) return make(argv[2], std::stoi(argv[3]));
  if (command == "own") return own(argv[2]);
  std::cerr << "usage: roundtrip make FOLDER COUNT | roundtrip own FOLDER\n";
  return 2;
}
