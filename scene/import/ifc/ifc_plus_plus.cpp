#include "scene/import/ifc/ifc_plus_plus.hpp"

#include <dlfcn.h>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {

std::filesystem::path ifcPlusPlusModule() {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto installed = program.parent_path().parent_path() / "lib/enfilade/ifc_plus_plus.so";
  return std::filesystem::is_regular_file(installed, error) ? installed : ENFILADE_IFC_PLUS_PLUS;
}

void sendShapesByIfcPlusPlus(std::string text) {
  const std::string module = ifcPlusPlusModule().string();
  void* opened = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* found = opened ? dlsym(opened, kSendShapes) : nullptr;
  if (!found) {
    const char* why = dlerror();
    throw ImportError("the reader " + module + " cannot be opened (" + (why ? why : "?") +
                      "): build or install the program again");
  }
  reinterpret_cast<SendShapes*>(found)(text);
}

}  // namespace enfilade::scene
