// Writes files atomically: a temporary file is renamed when it is complete.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace enfilade::render {

/// Writes a temporary file in the same folder and renames it, so that `file` is always complete.
/// Follows links; writes directly to devices and pipes. Throws std::runtime_error naming the file.
void writeFileAtomically(const std::filesystem::path& file, const void* data, std::size_t bytes);
inline void writeFileAtomically(const std::filesystem::path& file, std::string_view text) {
  writeFileAtomically(file, text.data(), text.size());
}

}  // namespace enfilade::render
