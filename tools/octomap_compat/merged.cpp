// Compares the files of a whole map, byte for byte, with those that OctoMap writes from its tables.
//
//   merged MAP RESOLUTION OURS.bt OURS.ot      exits with 1 if one differs
#include "voxtile_map.hpp"
#include <cstdio>
#include <sstream>

static bool is_same(const char* name, const std::string& ours, const std::string& octomaps) {
  const bool same = ours == octomaps;
  std::printf("{\"file\":\"%s\",\"bytes\":%zu,\"identical\":%s}\n", name, ours.size(), same ? "true" : "false");
  return same;
}

int main(int argc, char** argv) try {
  silence_octomap();
  if (argc != 5) {
    std::fprintf(stderr, "usage: merged MAP RESOLUTION OURS.bt OURS.ot\n");
    return 2;
  }
  octomap::OcTree tree(std::stod(argv[2]));
  // setNodeValue applies the default clamps, which equal the map's; no value changes.
  for (const auto& tile : tile_folders(argv[1]))
    for (const Entry& entry : table(tile)) tree.setNodeValue(entry.key, float(entry.log_odds), true);
  tree.updateInnerOccupancy();
  tree.prune();
  std::stringstream ot, bt;
  // writeBinary flattens the tree, so the log-odds are written first.
  tree.write(ot);
  tree.writeBinary(bt);
  const bool same_ot = is_same("ot", file_bytes(argv[4]), ot.str());
  return is_same("bt", file_bytes(argv[3]), bt.str()) && same_ot ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "merged: %s\n", error.what());
  return 2;
}
