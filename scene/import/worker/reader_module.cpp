#include "scene/import/worker/reader_module.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "scene/import/import_model.hpp"

namespace enfilade::scene {

std::filesystem::path moduleFile(const char* name, const char* variable, const char* built) {
  if (const char* named = std::getenv(variable); named != nullptr) return named;
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const auto& place : {folder / name, folder / "../lib/enfilade" / name})
    if (std::filesystem::is_regular_file(place, error)) return place;
  return built;
}

void* openModule(const std::filesystem::path& module, const char* symbol) {
  void* opened = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* found = opened ? dlsym(opened, symbol) : nullptr;
  if (found) return found;
  const char* why = dlerror();
  throw ImportError("the reader " + module.string() + " cannot be opened (" + (why ? why : "?") +
                    "): install it with the program, or raise the memory limit");
}

}  // namespace enfilade::scene
