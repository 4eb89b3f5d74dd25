// Reads files into memory.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>

#include "scene/import/file/import_options.hpp"

namespace enfilade::scene {

/// Reads a file, or its first `limit` bytes. Throws ImportError if it cannot be opened.
inline std::string readModelFile(const std::filesystem::path& file,
                                 std::size_t limit = std::string::npos) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ImportError(file.string() + ": cannot be opened for reading");
  std::string text(std::min(limit, static_cast<std::size_t>(file_size(file))), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace enfilade::scene
