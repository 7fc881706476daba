// Compares each tile's octree.bt, byte for byte, with the output of OctoMap's writeBinary for the tile's table.
//
//   tiles MAP RESOLUTION                  all tiles; exits with 1 if one differs
//   tiles --write TILE RESOLUTION STEM    writes OctoMap's STEM.bt and STEM.ot for one tile folder
#include "voxtile_map.hpp"
#include <cstdio>
#include <sstream>

// setNodeValue applies the default clamps, which equal the map's; no value changes.
static void fill(octomap::OcTree& tree, const std::filesystem::path& tile) {
  for (const Entry& entry : table(tile)) tree.setNodeValue(entry.key, float(entry.log_odds), true);
  tree.updateInnerOccupancy();
  tree.prune();
}

int main(int argc, char** argv) try {
  silence_octomap();
  if (argc == 5 && std::string(argv[1]) == "--write") {
    octomap::OcTree tree(std::stod(argv[3]));
    fill(tree, argv[2]);
    const std::string stem = argv[4];
    // writeBinary flattens the tree, so the log-odds are written first.
    return tree.write(stem + ".ot") && tree.writeBinary(stem + ".bt") ? 0 : 2;
  }
  if (argc != 3) {
    std::fprintf(stderr, "usage: tiles MAP RESOLUTION | tiles --write TILE RESOLUTION STEM\n");
    return 2;
  }
  unsigned long tiles = 0, identical = 0, bytes = 0;
  for (const auto& tile : tile_folders(argv[1])) {
    octomap::OcTree tree(std::stod(argv[2]));
    fill(tree, tile);
    std::stringstream expected;
    tree.writeBinary(expected);
    const std::string ours = file_bytes(tile / "octree.bt");
    ++tiles;
    bytes += ours.size();
    if (ours == expected.str()) ++identical;
    else std::printf("  differs: %s\n", tile.filename().c_str());
  }
  std::printf("{\"tiles\":%lu,\"identical\":%lu,\"bytes\":%lu}\n", tiles, identical, bytes);
  return identical == tiles ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "tiles: %s\n", error.what());
  return 2;
}
