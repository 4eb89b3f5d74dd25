// Imports IFC: chooses among three geometry readers, falls back when one fails, and builds a Model.
// Runs in the import worker, which starts one process per reader.
#pragma once

#include "scene/import/ifc/ifc_metadata.hpp"
#include "scene/import/worker/process.hpp"

namespace enfilade::scene {

/// Throws ImportError if no reader can read the file.
Model importIfc(const ImportRequest& request, const ImportProgress& progress);

}  // namespace enfilade::scene
