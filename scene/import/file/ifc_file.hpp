// Reads the text of an IFC file, STEP or XML, also from a zip archive.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace enfilade::scene {

/// Reads `.ifc` and `.ifcxml` directly and unpacks `.ifczip` in memory; the first bytes decide.
/// Throws ImportError if the file is unreadable, is not an archive, or would unpack to more than
/// `maxBytes`. It also throws if the archive does not contain exactly one .ifc or .ifcxml file.
std::string readIfcFile(const std::filesystem::path& file, std::size_t maxBytes);

}  // namespace enfilade::scene
