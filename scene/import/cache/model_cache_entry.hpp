// One entry of the model cache as bytes: what it was made from, a model stream, and a checksum of
// all of it. Private to scene/.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "scene/import/worker/content_hash.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Another file that the import read or looked for.
struct FileBeside {
  std::string path;  ///< as the importer tells it
  bool there = false;
  ContentHash content;  ///< zero where there was none
  bool operator==(const FileBeside&) const = default;
};

struct CacheEntry {
  ContentHash key;
  double importSeconds = 0;
  std::vector<FileBeside> beside;
  Model model;
};

std::vector<std::byte> serialiseEntry(const CacheEntry& entry);

/// Throws ModelStreamError saying what is wrong: nothing is read before the checksum holds.
CacheEntry deserialiseEntry(std::span<const std::byte> bytes);

}  // namespace enfilade::scene
