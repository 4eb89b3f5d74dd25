// IFC: which of three readers makes the shapes, what is done when one fails, and how a Model comes
// of it. Runs in the import process, which starts one more for each reader.
#pragma once

#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/ifc/ifc_metadata.hpp"
#include "scene/import/worker/process.hpp"

namespace enfilade::scene {

/// Throws ImportError when no reader can read the file.
Model importIfc(const ImportRequest& request, const ImportProgress& progress);

/// Names from the project down to each product, unique, by express id.
std::map<std::uint32_t, std::string> ifcPaths(const IfcFacts& facts);

/// A door or window that stands in a wall without a hole.
struct UncutOpening {
  const Object* object;
  std::uint32_t host;  ///< the wall's express id; 0: the file does not say whose opening it is
  int raysPassed;
};

struct OpeningCheck {
  std::size_t looked = 0;  ///< doors and windows that rays were sent through
  std::vector<UncutOpening> uncut;
  std::vector<const Object*> unchecked;  ///< they have no placement
};

/// Sends rays through each door and window of `model`. The answer points into the model.
OpeningCheck checkOpenings(const Model& model, const IfcFacts& facts);

void reportOpenings(const OpeningCheck& check, ProblemLog& problems);

/// Adds a body for each elevator whose stops can be told; the others are counted as `still_lifts`.
void findLifts(Model& model, const IfcFacts& facts, ProblemLog& problems);

}  // namespace enfilade::scene
