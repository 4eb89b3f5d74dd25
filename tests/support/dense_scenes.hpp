// Generated scenes where triangles are dense, as in furnished offices, plant rooms and scans.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::tests {

struct DenseScene {
  const char* name;
  const char* description;
  /// Makes the scene of about this many triangles; the same number makes the same scene.
  scene::Model (*make)(std::size_t triangles);
};

/// scan, office, shop, plant_room and terrain.
const std::vector<DenseScene>& listDenseScenes();

/// Null if no scene has this name.
const DenseScene* findDenseScene(const std::string& name);

}  // namespace enfilade::tests
