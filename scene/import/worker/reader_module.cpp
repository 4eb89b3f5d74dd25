#include "scene/import/worker/reader_module.hpp"

#include <dlfcn.h>

#include <cstdlib>

#include "scene/import/file/import_options.hpp"

namespace enfilade::scene {

std::filesystem::path findModule(const char* name, const char* variable, const char* builtPath) {
  if (const char* named = std::getenv(variable); named != nullptr) return named;
  std::error_code error;
  const auto folder = std::filesystem::read_symlink("/proc/self/exe", error).parent_path();
  for (const auto& candidate : {folder / name, folder / "../lib/enfilade" / name})
    if (std::filesystem::is_regular_file(candidate, error)) return candidate;
  return builtPath;
}

void* openModule(const std::filesystem::path& module, const char* symbol) {
  if (std::error_code error; !std::filesystem::is_regular_file(module, error))
    throw ImportError("the reader " + module.string() +
                      " is missing: build it (./dev build), or install it with the program");
  void* library = dlopen(module.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* address = library ? dlsym(library, symbol) : nullptr;
  if (address) return address;
  const char* reason = dlerror();
  throw ImportError("the reader " + module.string() + " cannot be opened (" +
                    (reason ? reason : "?") +
                    "): install it and what it needs, or raise the memory limit");
}

}  // namespace enfilade::scene
