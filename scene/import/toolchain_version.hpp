// Versions of the program and its readers, to decide whether a cached Model is still valid.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "scene/import/file/content_hash.hpp"

namespace enfilade::scene {

/// Returns a fingerprint of a file: the linker's build id of a program or library, which may be
/// large, else the content hash. nullopt: the file cannot be read.
std::optional<ContentHash> computeFileVersion(const std::filesystem::path& file);

/// Describes this program and its reader modules by their build ids, which change with every change
/// of the importer. Model::dependencies lists the libraries behind the modules.
const std::string& describeReaderVersions();

}  // namespace enfilade::scene
