#include "scene/import/file/ifc_file.hpp"

#include <array>
#include <string_view>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/read_file.hpp"
#include "scene/import/file/zip_archive.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::string_view, 2> kMemberExtensions{".ifc", ".ifcxml"};

std::string readWholeFile(const fs::path& file, std::size_t maxBytes) {
  if (fs::file_size(file) > maxBytes) {
    throw ImportError(file.string() + ": is larger than the " + std::to_string(maxBytes >> 20) +
                      " MiB allowed; split it or raise the memory limit");
  }
  return readModelFile(file);
}

}  // namespace

std::string readIfcFile(const fs::path& file, std::size_t maxBytes) {
  if (readModelFile(file, 12) == "ISO-10303-21") return readWholeFile(file, maxBytes);
  const bool named = file.extension() == ".ifczip" || file.extension() == ".IFCZIP";
  if (!named && readModelFile(file, 4) != "PK\3\4") return readWholeFile(file, maxBytes);
  return readOnlyZipMember(file, kMemberExtensions, maxBytes);
}

}  // namespace enfilade::scene
