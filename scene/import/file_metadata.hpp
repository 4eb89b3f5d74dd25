// Reads the metadata in the text of a model file that assimp does not pass on. These are the unit,
// the up axis, the writer, and whether the file is complete.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// Reads the metadata. Throws ImportError if the file is truncated, is not what its extension says,
/// or is an archive of more than `maxUnpacked` bytes. Not for IFC, whose text may come from one.
FileMetadata readFileMetadata(const std::filesystem::path& file, ModelFormat format,
                              std::size_t maxUnpacked);

/// Reads the metadata of an IFC file's text, for assimp.
FileMetadata readIfcFileMetadata(const std::string& text);

/// Returns a COLLADA file's text as assimp 5.2.5 can read it, or "" if the file needs no repair.
/// Counts repairs in `metadata.problems`.
std::string repairCollada(const std::filesystem::path& file, FileMetadata& metadata);

}  // namespace enfilade::scene
