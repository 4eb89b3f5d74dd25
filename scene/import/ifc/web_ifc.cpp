#include "scene/import/ifc/web_ifc.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

std::string nodeInPath() {
  const char* path = std::getenv("PATH");
  std::istringstream folders(path == nullptr ? "/usr/local/bin:/usr/bin:/bin" : path);
  for (std::string folder; std::getline(folders, folder, ':');) {
    for (const char* name : {"node", "nodejs"}) {
      const fs::path candidate = fs::path(folder) / name;
      std::error_code error;
      if (!folder.empty() && fs::is_regular_file(candidate, error) &&
          access(candidate.c_str(), X_OK) == 0) {
        return candidate.string();
      }
    }
  }
  return {};
}

std::vector<fs::path> scriptFolders() {
  if (const char* named = std::getenv("ENFILADE_WEB_IFC"); named != nullptr) return {named};
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return {program.parent_path().parent_path() / "share/enfilade/web_ifc", ENFILADE_IFC_SOURCES};
}

}  // namespace

WebIfcPlace findWebIfc() {
  WebIfcPlace place;
  place.node = nodeInPath();
  std::string looked;
  for (const fs::path& folder : scriptFolders()) {
    std::error_code error;
    const bool whole = fs::is_regular_file(folder / "read_ifc.js", error) &&
                       fs::is_directory(folder / "node_modules/web-ifc", error);
    looked += (looked.empty() ? "" : ", ") + folder.string();
    if (!whole) continue;
    place.script = (folder / "read_ifc.js").string();
    break;
  }
  if (place.script.empty()) {
    place.missing = "web-ifc is not in " + looked + " (call npm ci there, or ./dev)";
  } else if (place.node.empty()) {
    place.missing = "Node.js is not installed (apt-get install nodejs npm, or ./dev)";
  }
  return place;
}

}  // namespace enfilade::scene
