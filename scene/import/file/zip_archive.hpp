// Unzips one file of a ZIP archive, and limits the unpacked size of archives that libraries unpack.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// Unzips the archive's only file with one of these extensions (at least one, lower case, with the
/// dot; names match in any case). Throws ImportError, which names the first extension: no or
/// several such files, encrypted, damaged, larger than `maxBytes`.
std::string readOnlyZipMember(const std::filesystem::path& file,
                              std::span<const std::string_view> extensions, std::size_t maxBytes);

/// Throws ImportError if the archive is damaged, or if its directory announces more than `maxBytes`
/// of all files together. Unpacking does not exceed that number. Nothing is unpacked.
void limitZipMembers(const std::filesystem::path& file, std::size_t maxBytes);

}  // namespace enfilade::scene
