// Imports a model file into one compact Model. A child process of this executable does the parsing,
// because a bad file can crash, hang or exhaust memory.
#pragma once

#include <filesystem>

#include "scene/import/file/import_options.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Imports the model in metres, Y up, near its origin. Throws ImportError.
Model importModel(const std::filesystem::path& file, const ImportOptions& options = {},
                  const ImportProgress& progress = {});

}  // namespace enfilade::scene
