#include "scene/import/ifc/web_ifc.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <sstream>
#include <vector>

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;

std::string findNodeExecutable() {
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

std::vector<fs::path> listScriptFolders() {
  if (const char* named = std::getenv("ENFILADE_WEB_IFC"); named != nullptr) return {named};
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  return {program.parent_path().parent_path() / "share/enfilade/web_ifc", ENFILADE_IFC_SOURCES};
}

}  // namespace

WebIfcLocation findWebIfc() {
  WebIfcLocation location;
  location.node = findNodeExecutable();
  std::string searched;
  for (const fs::path& folder : listScriptFolders()) {
    std::error_code error;
    const bool whole = fs::is_regular_file(folder / "read_ifc.js", error) &&
                       fs::is_directory(folder / "node_modules/web-ifc", error);
    searched += (searched.empty() ? "" : ", ") + folder.string();
    if (!whole) continue;
    location.script = (folder / "read_ifc.js").string();
    break;
  }
  if (location.script.empty()) {
    location.missing = "web-ifc is not in " + searched + " (run npm ci there, or ./dev)";
  } else if (location.node.empty()) {
    location.missing = "Node.js is not installed (apt-get install nodejs npm, or ./dev)";
  }
  return location;
}

}  // namespace enfilade::scene
