// Unzips one file of an archive.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>

namespace enfilade::scene {

/// Unzips the archive's only file with this extension (lower case, with the dot; names match in any
/// case). Throws ImportError: no or several such files, encrypted, damaged, larger than `maxBytes`.
std::string readOnlyZipMember(const std::filesystem::path& file, const std::string& extension,
                              std::size_t maxBytes);

}  // namespace enfilade::scene
