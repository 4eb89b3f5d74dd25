// A plan of each storey with coordinates on its frame, to read positions for scripts from.
#pragma once

#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

struct StoreyFloor {
  double height = 0;  ///< metres, scene frame
  std::string name;   ///< as the file calls it, or empty
};

/// Heights at which much floor lies that somebody could walk on and something stands on, ascending;
/// of a scene without any floor, its lowest point.
std::vector<StoreyFloor> storeysOf(const scene::Scene& scene);

/// The plan of one storey in a frame with the coordinates of the scene; nullopt when no picture is
/// to be had.
std::optional<render::Image> drawStoreyPlan(const scene::Scene& scene, const StoreyFloor& storey,
                                            const TakePicture& picture);

}  // namespace enfilade::server
