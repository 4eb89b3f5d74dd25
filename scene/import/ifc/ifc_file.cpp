#include "scene/import/ifc/ifc_file.hpp"

#include <fstream>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/zip_archive.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

bool startsWith(const fs::path& file, const std::string& magic) {
  std::ifstream in(file, std::ios::binary);
  std::string start(magic.size(), '\0');
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  return start == magic;
}

std::string readWholeFile(const fs::path& file, std::size_t maxBytes) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw ImportError(file.string() + ": cannot be opened for reading");
  const std::size_t size = static_cast<std::size_t>(file_size(file));
  if (size > maxBytes) {
    throw ImportError(file.string() + ": is larger than the " + std::to_string(maxBytes >> 20) +
                      " MiB allowed; split it or raise the memory limit");
  }
  std::string text(size, '\0');
  in.read(text.data(), static_cast<std::streamsize>(size));
  text.resize(static_cast<std::size_t>(in.gcount()));
  return text;
}

}  // namespace

std::string readIfcFile(const fs::path& file, std::size_t maxBytes) {
  if (startsWith(file, "ISO-10303-21")) return readWholeFile(file, maxBytes);
  const bool named = file.extension() == ".ifczip" || file.extension() == ".IFCZIP";
  if (!named && !startsWith(file, "PK\3\4")) return readWholeFile(file, maxBytes);
  return readOnlyZipMember(file, ".ifc", maxBytes);
}

}  // namespace enfilade::scene
