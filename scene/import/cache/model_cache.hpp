// Models that were imported before, kept on disk: a second start of the same file reads back what
// the first one made of it. An entry is found by what the file holds, not by its name or its time.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/import_model.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

struct ModelCache {
  std::filesystem::path folder;  ///< made when the first entry is written
  /// Bytes that all entries may take together; those not read for longest go first.
  std::uintmax_t mostBytes = std::uintmax_t{4} << 30;
};

/// $XDG_CACHE_HOME/enfilade, else ~/.cache/enfilade (XDG Base Directory Specification 0.8), as the
/// environment says: ENFILADE_CACHE=off gives none, ENFILADE_CACHE=/a/folder that folder,
/// ENFILADE_CACHE_MB another bound. nullopt when there is none or no home is known.
std::optional<ModelCache> modelCacheOfEnvironment();

struct LoadedModel {
  Model model;
  bool fromCache = false;
  double importSeconds = 0;  ///< that the import took, now or when the entry was made
  double loadSeconds = 0;    ///< that it took now
  /// What went wrong with the cache and was helped by importing, one line each: a damaged entry, a
  /// folder that cannot be written, a disk that is full.
  std::vector<std::string> notes;
};

/// importModel(), with meshes of equal content stored once, or what a cache kept of it. An entry
/// serves only if the file, each other file that was read or looked for, the options, this program
/// and its readers are what they were, and if its checksum holds. Throws ImportError.
LoadedModel loadModel(const std::filesystem::path& file, const ImportOptions& options,
                      const std::optional<ModelCache>& cache, const ImportProgress& progress = {});

/// What was worked out of a model at some cost, as a text kept beside the entries under `key`,
/// which says all that it follows from but the program, which is added. nullopt when none is kept,
/// or the checksum does not hold.
std::optional<std::string> keptText(const ModelCache& cache, const std::string& key);

/// Keeps it for the next start. Returns what went wrong, or "".
std::string keepText(const ModelCache& cache, const std::string& key, const std::string& text);

}  // namespace enfilade::scene
