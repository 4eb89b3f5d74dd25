// Whether web-ifc can read IFC on this machine: it needs Node.js and one `npm ci`.
#pragma once

#include <gtest/gtest.h>

#include <cstdlib>
#include <vector>

#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/import_model.hpp"

namespace enfilade::tests {

/// Tests skip web-ifc if it is missing. In CI its absence fails the calling test, so that no reader
/// is skipped unnoticed.
inline bool hasWebIfc() {
  const std::string missing = scene::findWebIfc().missing;
  if (!missing.empty() && std::getenv("CI") != nullptr)
    ADD_FAILURE() << "CI tests every reader of IFC, but " << missing;
  return missing.empty();
}

/// The readers of IFC that this machine can run.
inline std::vector<scene::IfcReader> listReadersHere() {
  std::vector<scene::IfcReader> readers{scene::IfcReader::ifcPlusPlus};
  if (hasWebIfc()) readers.push_back(scene::IfcReader::webIfc);
  return readers;
}

inline scene::ImportOptions makeReaderOptions(scene::IfcReader reader) {
  scene::ImportOptions options;
  options.ifcReader = reader;
  return options;
}

}  // namespace enfilade::tests

/// Ends the test if web-ifc is missing: as skipped, or in CI as failed.
#define ENFILADE_NEED_WEB_IFC() \
  if (!enfilade::tests::hasWebIfc()) GTEST_SKIP() << enfilade::scene::findWebIfc().missing
