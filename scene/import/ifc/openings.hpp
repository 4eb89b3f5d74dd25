// Checks that doors and windows are in openings. IFC readers cut openings out of walls by solid
// modelling, which can fail silently and leave an impassable wall.
//
// A grid of rays perpendicular to the host is cast through each door and window and intersected
// only with the host's triangles. The opening counts as cut if nearly all rays pass: a bar or a
// sill may block a few. If IfcRelVoidsElement or IfcRelFillsElement is missing, the hosts are the
// walls that overlap the door or window.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scene/import/ifc/ifc_metadata.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A door or window in a wall without an opening.
struct UncutOpening {
  const Object* object;
  std::uint32_t host;  ///< the wall's express id; 0: the file does not state the host
  int raysPassed;
};

/// The result of checkOpenings().
struct OpeningCheck {
  std::size_t checked = 0;  ///< doors and windows tested with rays
  std::vector<UncutOpening> uncut;
  std::vector<const Object*> unchecked;  ///< without a placement
};

/// Casts rays through each door and window of `model`. The result points into the model.
OpeningCheck checkOpenings(const Model& model, const IfcMetadata& metadata);

void reportOpenings(const OpeningCheck& check, std::vector<Diagnostic>& diagnostics);

/// Whether a wall is larger than all doors and windows in it: cutting them leaves some of it.
bool isLargerThanOpenings(const Model& model, const IfcMetadata& metadata, const IfcProduct& wall);

}  // namespace enfilade::scene
