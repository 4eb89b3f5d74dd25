// Serializes an entry of the model cache: its key and dependencies, a model stream, and a checksum.
// Private to scene/.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "scene/import/file/content_hash.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Another file that the import read or looked for.
struct Dependency {
  std::string path;  ///< as the importer reports it
  bool exists = false;
  ContentHash content;  ///< zero if the file does not exist
  bool operator==(const Dependency&) const = default;
};

/// Content of a cache entry.
struct CacheEntry {
  ContentHash key;
  double importSeconds = 0;
  std::vector<Dependency> dependencies;
  Model model;
};

std::vector<std::byte> serializeEntry(const CacheEntry& entry);

/// Checks the checksum before it reads anything else. Throws ModelStreamError with the reason.
CacheEntry deserializeEntry(std::span<const std::byte> bytes);

}  // namespace enfilade::scene
