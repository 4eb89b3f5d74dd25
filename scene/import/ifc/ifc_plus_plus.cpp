#include "scene/import/ifc/ifc_plus_plus.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {

std::filesystem::path ifcPlusPlusModule() {
  if (const char* named = std::getenv("ENFILADE_IFC_PLUS_PLUS"); named != nullptr) return named;
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const char* place : {"ifc_plus_plus.so", "../lib/enfilade/ifc_plus_plus.so"})
    if (std::filesystem::is_regular_file(folder / place, error)) return folder / place;
  return ENFILADE_IFC_PLUS_PLUS;
}

void sendShapesByIfcPlusPlus(std::string text) {
  const std::string module = ifcPlusPlusModule().string();
  void* opened = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* found = opened ? dlsym(opened, kSendShapes) : nullptr;
  if (!found) {
    const char* why = dlerror();
    throw ImportError("the reader " + module + " cannot be opened (" + (why ? why : "?") +
                      "): install it with the program, or raise the memory limit");
  }
  reinterpret_cast<SendShapes*>(found)(text);
}

}  // namespace enfilade::scene
