// Finds surfaces of different objects that lie in one plane, face the same side and overlap. Which
// of them a picture shows is decided pixel by pixel by rounding, so that they flicker.
#pragma once

#include <cstddef>
#include <string>

#include "scene/model/model.hpp"

namespace enfilade::scene {

struct CoplanarSurfaces {
  std::size_t pairs = 0;   ///< of objects; at least so many if `isComplete` is false
  std::string example;     ///< the paths of the pair whose triangles overlap most
  bool isComplete = true;  ///< false: the scene has too many surfaces in one plane
};

/// Compares drawn triangles of 0.01 m^2 or more. Surfaces of equal materials are left out, because
/// without vertex colours they flicker only in ids.
CoplanarSurfaces findCoplanarSurfaces(const Model& model);

}  // namespace enfilade::scene
