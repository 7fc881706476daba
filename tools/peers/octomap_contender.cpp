// OctoMap's side of the comparison: inserts a stream of scans, eagerly, and prints one line of JSON.
//
//   octomap_contender STREAM RESOLUTION_M [--scans N] [--max-range M] [--rays]
//                     [--anywhere POINTS --known POINTS --least-seconds S] [--bt FILE] [--dump FILE]
//
// Reads the whole stream into memory. --rays uses insertPointCloudRays, which has no max range. In this order: times
// the insertions, measures the memory, times the queries, dumps the voxels, times writeBinary (which flattens the
// tree).
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <octomap/octomap.h>
#include <stdexcept>
#include <string>
#include <vector>

struct Scan {
  octomap::point3d origin;
  octomap::Pointcloud cloud;
};

struct Options {
  std::string stream, anywhere, known, bt, dump;
  double resolution = 0.0, max_range = -1.0, least_seconds = 0.5;  // A negative range means no limit.
  uint64_t scans = UINT64_MAX;
  bool rays = false;
};

struct Answers {
  double ns = 0.0;
  uint64_t known = 0, occupied = 0;
};

static double number(const std::string& text) {
  char* end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (text.empty() || *end != '\0' || !std::isfinite(value)) throw std::runtime_error(text + ": not a number");
  return value;
}

static Options options_of(int argc, char** argv) {
  Options options;
  std::vector<std::string> places;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    const auto value = [&]() -> std::string {
      if (++i == argc) throw std::runtime_error(name + " requires a value");
      return argv[i];
    };
    if (name == "--rays") options.rays = true;
    else if (name == "--scans") options.scans = uint64_t(number(value()));
    else if (name == "--max-range") options.max_range = number(value());
    else if (name == "--least-seconds") options.least_seconds = number(value());
    else if (name == "--anywhere") options.anywhere = value();
    else if (name == "--known") options.known = value();
    else if (name == "--bt") options.bt = value();
    else if (name == "--dump") options.dump = value();
    else if (name.rfind("--", 0) == 0) throw std::runtime_error(name + ": unknown option");
    else places.push_back(name);
  }
  if (places.size() != 2) throw std::runtime_error("STREAM and RESOLUTION_M are required");
  if (options.anywhere.empty() != options.known.empty())
    throw std::runtime_error("--anywhere and --known must be given together");
  options.stream = places[0];
  options.resolution = number(places[1]);
  if (options.resolution <= 0.0) throw std::runtime_error("the resolution must be above 0 m");
  return options;
}

static std::ifstream opened(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error(path + ": cannot read");
  return file;
}

static bool read_point(std::istream& in, octomap::point3d& point) {
  float xyz[3];
  if (!in.read(reinterpret_cast<char*>(xyz), sizeof xyz)) return false;
  point = octomap::point3d(xyz[0], xyz[1], xyz[2]);
  return true;
}

static std::vector<Scan> read_scans(const Options& options) {
  std::ifstream in = opened(options.stream);
  std::vector<Scan> scans;
  uint32_t count = 0;
  while (scans.size() < options.scans && in.read(reinterpret_cast<char*>(&count), sizeof count)) {
    scans.emplace_back();
    Scan& scan = scans.back();
    bool whole = read_point(in, scan.origin);
    octomap::point3d point;
    // The count may be wrong in a damaged stream, so the reserved memory is bounded.
    scan.cloud.reserve(std::min(count, uint32_t(1) << 20));
    for (uint32_t i = 0; whole && i < count; ++i) {
      whole = read_point(in, point);
      scan.cloud.push_back(point);
    }
    if (!whole) throw std::runtime_error(options.stream + ": ends within a scan; write it again");
  }
  return scans;
}

static std::vector<octomap::point3d> read_points(const std::string& path) {
  std::ifstream in = opened(path);
  std::vector<octomap::point3d> points;
  octomap::point3d point;
  while (read_point(in, point)) points.push_back(point);
  return points;
}

static double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

static double cpu_s() {
  timespec time;
  if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) != 0) throw std::runtime_error("the CPU clock cannot be read");
  return double(time.tv_sec) + 1e-9 * double(time.tv_nsec);
}

// Resident memory of the process in bytes, from Linux.
static int64_t resident_bytes() {
  std::ifstream status = opened("/proc/self/status");
  for (std::string line; std::getline(status, line);)
    if (line.rfind("VmRSS:", 0) == 0) return 1024 * std::atoll(line.c_str() + 6);
  throw std::runtime_error("/proc/self/status: no line VmRSS");
}

// Number of finest voxels in the tree.
static uint64_t finest_voxels(const octomap::OcTree& tree) {
  uint64_t voxels = 0;
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf)
    voxels += uint64_t(1) << (3 * (tree.getTreeDepth() - leaf.getDepth()));
  return voxels;
}

static Answers query(const octomap::OcTree& tree, const std::string& path, double least_seconds) {
  const std::vector<octomap::point3d> points = read_points(path);
  Answers answers;
  double seconds = 0.0;
  uint64_t queries = 0;
  do {
    answers.known = answers.occupied = 0;
    const double start = cpu_s();
    for (const octomap::point3d& point : points) {
      const octomap::OcTreeNode* node = tree.search(point);
      if (!node) continue;
      ++answers.known;
      answers.occupied += tree.isNodeOccupied(node);
    }
    seconds += cpu_s() - start;
    queries += points.size();
  } while (seconds < least_seconds && !points.empty());
  answers.ns = queries ? 1e9 * seconds / double(queries) : 0.0;
  return answers;
}

// Writes every finest voxel: index 3 x i32, count i32 (0, as OctoMap has none), log-odds f64. Expands pruned leaves.
static void dump(const octomap::OcTree& tree, const std::string& path) {
  std::ofstream out(path, std::ios::binary);
  for (auto leaf = tree.begin_leafs(), end = tree.end_leafs(); leaf != end; ++leaf) {
    const octomap::OcTreeKey low = leaf.getIndexKey();
    const int edge = 1 << (tree.getTreeDepth() - leaf.getDepth());
    const double log_odds = leaf->getLogOdds();
    for (int x = 0; x < edge; ++x)
      for (int y = 0; y < edge; ++y)
        for (int z = 0; z < edge; ++z) {
          const int32_t whole[4] = {low[0] + x - 32768, low[1] + y - 32768, low[2] + z - 32768, 0};
          out.write(reinterpret_cast<const char*>(whole), sizeof whole);
          out.write(reinterpret_cast<const char*>(&log_odds), sizeof log_odds);
        }
  }
  if (!out.flush()) throw std::runtime_error(path + ": cannot write");
}

static void print(const char* name, const Answers& answers) {
  std::printf("\"%s\":{\"ns\":%.3f,\"known\":%lu,\"occupied\":%lu}", name, answers.ns,
              (unsigned long)answers.known, (unsigned long)answers.occupied);
}

int main(int argc, char** argv) try {
  const Options options = options_of(argc, argv);
  const std::vector<Scan> scans = read_scans(options);
  octomap::OcTree tree(options.resolution);
  tree.setProbHit(0.7);
  tree.setProbMiss(0.4);
  tree.setClampingThresMin(0.1192);
  tree.setClampingThresMax(0.971);

  const int64_t resident_before = resident_bytes();
  const double cpu_before = cpu_s(), wall_before = wall_s();
  for (const Scan& scan : scans) {
    if (options.rays) tree.insertPointCloudRays(scan.cloud, scan.origin, -1.0, false);
    else tree.insertPointCloud(scan.cloud, scan.origin, options.max_range, false, false);
  }
  const double wall = wall_s() - wall_before, cpu = cpu_s() - cpu_before;
  const int64_t resident = std::max(resident_bytes() - resident_before, int64_t(0));

  std::printf("{\"scans\":%lu,\"cpu_s\":%.9f,\"wall_s\":%.9f,\"voxels\":%lu,\"bytes\":%lu,\"resident_bytes\":%lu",
              (unsigned long)scans.size(), cpu, wall, (unsigned long)finest_voxels(tree),
              (unsigned long)tree.memoryUsage(), (unsigned long)resident);
  if (!options.anywhere.empty()) {
    const Answers anywhere = query(tree, options.anywhere, options.least_seconds);
    const Answers known = query(tree, options.known, options.least_seconds);
    std::printf(",\"questions\":{");
    print("anywhere", anywhere);
    std::printf(",");
    print("known", known);
    std::printf("}");
  }
  if (!options.dump.empty()) dump(tree, options.dump);
  if (!options.bt.empty()) {
    const double start = wall_s();
    if (!tree.writeBinary(options.bt)) throw std::runtime_error(options.bt + ": cannot write");
    std::printf(",\"write_s\":%.9f", wall_s() - start);
  }
  std::printf("}\n");
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "octomap_contender: %s\n", error.what());
  return 1;
}
