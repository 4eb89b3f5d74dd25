// Loads reader modules at run time. Linking the readers' libraries takes as long as loading many a
// scene, so only the process that needs a reader opens its module.
#pragma once

#include <filesystem>

namespace enfilade::scene {

/// Returns the path of module `name`: from the environment `variable`, next to the program, its
/// installed place, or `builtPath`.
std::filesystem::path findModule(const char* name, const char* variable, const char* builtPath);

/// Returns the symbol `symbol` of a module, which stays loaded. Throws ImportError if it cannot be
/// opened.
void* openModule(const std::filesystem::path& module, const char* symbol);

}  // namespace enfilade::scene
