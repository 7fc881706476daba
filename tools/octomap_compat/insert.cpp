// Maps a stream of scans with the OctoMap library and compares every finest voxel with a voxtile map.
//
//   insert SCANS RESOLUTION MAP [--list N]
//
// SCANS is what points.py writes ("-" for stdin). --list prints the first N differing voxels. Exits with 1 below
// 99.99 % agreement.
#include "voxtile_map.hpp"
#include <chrono>
#include <cmath>
#include <cstdio>

static const double MAX_RANGE_M = 60.0;
static const double TOLERANCE = 1e-3;
static const double MIN_PERCENT = 99.99;

static bool read_floats(std::istream& in, float* values, size_t count) {
  return bool(in.read(reinterpret_cast<char*>(values), std::streamsize(count * sizeof(float))));
}

// Reads one scan of the stream; returns false at its end.
static bool read_scan(std::istream& in, octomap::point3d& origin, octomap::Pointcloud& cloud) {
  uint32_t count;
  if (!in.read(reinterpret_cast<char*>(&count), 4)) return false;
  float xyz[3];
  cloud.clear();
  cloud.reserve(count);
  for (uint32_t i = 0; i <= count; ++i) {
    if (!read_floats(in, xyz, 3)) throw std::runtime_error("the stream of scans ends within a scan");
    const octomap::point3d point(xyz[0], xyz[1], xyz[2]);
    if (i == 0) origin = point;
    else cloud.push_back(point);
  }
  return true;
}

// Number of finest voxels in the tree.
static uint64_t finest_voxels(const octomap::OcTree& tree) {
  uint64_t voxels = 0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf)
    voxels += uint64_t(1) << (3 * (tree.getTreeDepth() - leaf.getDepth()));
  return voxels;
}

struct Counts {
  uint64_t agree = 0, other_class = 0, other_value = 0, only_octomap = 0, only_voxtile = 0;
  double largest_difference = 0;  // Among the voxels that agree.
};

static Counts compare(const octomap::OcTree& tree, const std::string& map, uint64_t list) {
  Counts counts;
  const auto show = [&](const char* what, const octomap::OcTreeKey& key, double ours, double theirs) {
    if (list == 0) return;
    --list;
    std::printf("%-12s voxel %d %d %d voxtile %.6f octomap %.6f\n", what, key[0] - 32768, key[1] - 32768,
                key[2] - 32768, ours, theirs);
  };
  for (const auto& tile : tile_folders(map)) {
    for (const Entry& entry : table(tile)) {
      const octomap::OcTreeNode* node = tree.search(entry.key);
      if (!node) {
        ++counts.only_voxtile;
        show("only voxtile", entry.key, entry.log_odds, NAN);
        continue;
      }
      const double theirs = node->getLogOdds();
      const double difference = std::abs(theirs - entry.log_odds);
      if ((theirs >= 0) != (entry.log_odds >= 0)) {
        ++counts.other_class;
        show("other class", entry.key, entry.log_odds, theirs);
      } else if (!(difference <= TOLERANCE)) {
        ++counts.other_value;
        show("other value", entry.key, entry.log_odds, theirs);
      } else {
        ++counts.agree;
        counts.largest_difference = std::max(counts.largest_difference, difference);
      }
    }
  }
  // Every voxel of the table was looked up, so only OctoMap has the rest of the tree.
  const uint64_t both = counts.agree + counts.other_class + counts.other_value;
  counts.only_octomap = finest_voxels(tree) - both;
  return counts;
}

int main(int argc, char** argv) try {
  silence_octomap();
  if (argc < 4) {
    std::fprintf(stderr, "usage: insert SCANS RESOLUTION MAP [--list N]\n");
    return 2;
  }
  const double resolution = std::stod(argv[2]);
  const uint64_t list = argc > 5 && std::string(argv[4]) == "--list" ? std::stoull(argv[5]) : 0;
  octomap::OcTree tree(resolution);
  tree.setProbHit(0.7);
  tree.setProbMiss(0.4);
  tree.setClampingThresMin(0.1192);
  tree.setClampingThresMax(0.971);

  std::ifstream file;
  if (std::string(argv[1]) != "-") {
    file.open(argv[1], std::ios::binary);
    if (!file) throw std::runtime_error(std::string("cannot read ") + argv[1]);
  }
  std::istream& in = file.is_open() ? file : std::cin;
  octomap::point3d origin;
  octomap::Pointcloud cloud;
  uint64_t scans = 0, points = 0;
  double seconds = 0;
  while (read_scan(in, origin, cloud)) {
    const auto start = std::chrono::steady_clock::now();
    tree.insertPointCloud(cloud, origin, MAX_RANGE_M, false);
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    ++scans;
    points += cloud.size();
  }

  const Counts counts = compare(tree, argv[3], list);
  const uint64_t both = counts.agree + counts.other_class + counts.other_value;
  const uint64_t all = both + counts.only_octomap + counts.only_voxtile;
  const double percent = all ? 100.0 * double(counts.agree) / double(all) : 0.0;
  const auto row = [](const char* name, uint64_t value) { std::printf("  %-28s %12lu\n", name, (unsigned long)value); };
  row("scans", scans);
  row("points", points);
  row("voxels, union", all);
  row("in both", both);
  row("agree", counts.agree);
  row("in both, other class", counts.other_class);
  row("in both, other log-odds", counts.other_value);
  row("only OctoMap", counts.only_octomap);
  row("only voxtile", counts.only_voxtile);
  std::printf("  %-28s %12.6f %%\n", "agreement", percent);
  std::printf("{\"resolution\":%g,\"scans\":%lu,\"points\":%lu,\"union\":%lu,\"both\":%lu,\"agree\":%lu,"
              "\"other_class\":%lu,\"other_log_odds\":%lu,\"only_octomap\":%lu,\"only_voxtile\":%lu,"
              "\"largest_difference\":%g,\"percent\":%.6f,\"octomap_seconds\":%.2f}\n",
              resolution, (unsigned long)scans, (unsigned long)points, (unsigned long)all, (unsigned long)both,
              (unsigned long)counts.agree, (unsigned long)counts.other_class, (unsigned long)counts.other_value,
              (unsigned long)counts.only_octomap, (unsigned long)counts.only_voxtile, counts.largest_difference,
              percent, seconds);
  return percent >= MIN_PERCENT ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "insert: %s\n", error.what());
  return 2;
}
