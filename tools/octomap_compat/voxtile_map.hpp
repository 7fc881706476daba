// The tables of a voxtile map, read without voxtile: a folder of tile_X_Y_Z/iwlo_meta.bin.
#pragma once
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <octomap/octomap.h>
#include <stdexcept>
#include <string>
#include <vector>

struct Entry {
  octomap::OcTreeKey key;
  double log_odds;
};

// OctoMap prints a message to std::cerr for every file that it reads or writes.
inline void silence_octomap() { std::cerr.setstate(std::ios::failbit); }

inline std::string file_bytes(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("cannot read " + path.string());
  return {std::istreambuf_iterator<char>(file), {}};
}

inline std::vector<std::filesystem::path> tile_folders(const std::filesystem::path& map) {
  std::vector<std::filesystem::path> folders;
  for (const auto& entry : std::filesystem::directory_iterator(map))
    if (entry.is_directory() && entry.path().filename().string().rfind("tile_", 0) == 0)
      folders.push_back(entry.path());
  if (folders.empty()) throw std::runtime_error("no tiles in " + map.string());
  return folders;
}

// Header of 16 bytes (magic, version, count), then entries of 18 bytes; the rest is used by voxtile only.
inline std::vector<Entry> table(const std::filesystem::path& tile) {
  const std::string bytes = file_bytes(tile / "iwlo_meta.bin");
  uint32_t magic = 0, version = 0;
  uint64_t count = 0;
  if (bytes.size() >= 16) {
    std::memcpy(&magic, &bytes[0], 4);
    std::memcpy(&version, &bytes[4], 4);
    std::memcpy(&count, &bytes[8], 8);
  }
  if (magic != 0x49574C4F || version != 1 || count > (bytes.size() - 16) / 18)
    throw std::runtime_error("no table in " + tile.string());
  std::vector<Entry> entries(count);
  const char* at = &bytes[16];
  for (Entry& entry : entries) {
    std::memcpy(&entry.key.k[0], at, 6);
    std::memcpy(&entry.log_odds, at + 6, 8);
    at += 18;
  }
  return entries;
}
