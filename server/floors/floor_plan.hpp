// The floor plan of a storey as plain data: cut walls, doors with their swing, rooms. Maps and
// plans draw it; clients ask for it (FloorPlanRequest).
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"
#include "server/floors/storeys.hpp"

namespace enfilade::server {

using collision::Vec3;

/// Lines of one object or body: scene frame, metres, at the height of the cut.
struct PlanShape {
  enum class Kind : std::uint8_t {
    furniture,  ///< ends below the tops of doors, or begins above the floor: shelves, windows
    wall,       ///< reaches from the floor to above doors
    body,       ///< moves, and is no door
    door,       ///< the leaf at the pose of the model
    openDoor,   ///< the leaf at a limit of its hinge
    swing,      ///< between both, or the open leaf of a sliding door
    lift,
  };
  Kind kind = Kind::furniture;
  scene::EntityId entity = 0;            ///< index of the object, or of a body's first one, + 1
  std::vector<std::vector<Vec3>> loops;  ///< closed outlines
  std::vector<std::vector<Vec3>> lines;  ///< of open surfaces, and of signs
};

struct FloorPlan {
  double floor = 0;                 ///< metres
  std::string storey;               ///< name in the file, or empty
  std::vector<PlanShape> shapes;    ///< in the order of drawing
  std::vector<scene::Space> rooms;  ///< of the storey
  std::optional<Eigen::Vector2d> north;
};

/// Cuts the scene kPlanCutHeight above the floor of a storey; bodies are where the model has them.
FloorPlan computeFloorPlan(const scene::Scene& scene, const StoreyFloor& storey);

/// The storey of the file at this floor; without one near: its floor alone.
StoreyFloor findStoreyAt(const std::vector<StoreyFloor>& storeys, double floor);

/// Finds the plan at the height of a floor; nullopt without one.
using FloorPlanSource = std::function<std::optional<FloorPlan>(double floor)>;

/// Plans of a scene in this process: each height has one.
FloorPlanSource makeFloorPlanSource(std::shared_ptr<const scene::Scene> scene);

}  // namespace enfilade::server
