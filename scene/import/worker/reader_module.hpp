// Libraries that read models are as slow to link at run time as many a scene to load, so each
// stands behind a module of ours that only the process opens that reads with it.
#pragma once

#include <filesystem>

namespace enfilade::scene {

/// Where the module `name` is: named by the environment's `variable`, beside the program, where it
/// is installed, or where it was `built`.
std::filesystem::path moduleFile(const char* name, const char* variable, const char* built);

/// What `module` exports as `symbol`, for as long as the process lives. Throws ImportError where it
/// cannot be opened.
void* openModule(const std::filesystem::path& module, const char* symbol);

}  // namespace enfilade::scene
