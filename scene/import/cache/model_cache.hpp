// On-disk cache of imported models, so that a restart with the same file loads the earlier result.
// The key is the file's content, not its name or time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/import_options.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Location and size limit of the cache.
struct ModelCache {
  std::filesystem::path folder;  ///< created with the first entry
  /// Maximal total size in bytes; the least recently read entries are evicted first.
  std::uintmax_t maxBytes = std::uintmax_t{4} << 30;
};

/// Cache of the environment: $XDG_CACHE_HOME/enfilade, else ~/.cache/enfilade (XDG Base Directory
/// Specification 0.8). ENFILADE_CACHE=off disables it, ENFILADE_CACHE=/a/folder sets the folder,
/// ENFILADE_CACHE_MB the limit. nullopt: disabled, or no home directory.
std::optional<ModelCache> findDefaultModelCache();

/// A model, and how it was obtained.
struct LoadedModel {
  Model model;
  bool fromCache = false;
  double importSeconds = 0;  ///< duration of the import, now or when the entry was made
  double loadSeconds = 0;    ///< duration of this call
  /// Cache problems that an import made up for, one line each: a damaged entry, a read-only folder,
  /// a full disk.
  std::vector<std::string> notes;
};

/// Returns the cached model, or imports it with equal meshes stored once. An entry is valid only if
/// the file, its dependencies, the options, this program and its readers are unchanged, and the
/// checksum is correct. Throws ImportError.
LoadedModel loadModel(const std::filesystem::path& file, const ImportOptions& options,
                      const std::optional<ModelCache>& cache, const ImportProgress& progress = {});

/// Returns the text, or bytes, cached under `key`; nullopt if it is missing or damaged. The key
/// must contain all inputs of the text; the program's version is added. `damage`: set to what is
/// wrong with the file.
std::optional<std::string> loadCachedText(const ModelCache& cache, const std::string& key,
                                          std::string* damage = nullptr);

/// Stores a text for the next start. Returns the error, or "".
std::string storeCachedText(const ModelCache& cache, const std::string& key,
                            const std::string& text);

}  // namespace enfilade::scene
