// Imports PLY and STL files. Runs only in the import worker.
#pragma once

#include <filesystem>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// `format` is ply or stl. Throws ImportError.
Model importScan(const std::filesystem::path& file, ModelFormat format,
                 const ImportOptions& options, const ImportProgress& progress);

}  // namespace enfilade::scene
