// Floor plans per storey with coordinates on the frame, for writing scripts.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

struct StoreyFloor {
  double height = 0;  ///< metres, scene frame
  std::string name;   ///< name in the file, or empty
  /// The storey of the file: an index into Model::storeys; nullopt: it was found by its floor.
  std::optional<std::uint32_t> storey = std::nullopt;
};

/// The storeys of the file that have walls, at their floors. If the file states none: the heights
/// of large walkable floors with walls. Ascending. A scene without floors has one storey at its
/// lowest point.
std::vector<StoreyFloor> findStoreys(const scene::Scene& scene);

/// Draws the plan of one storey in a frame with scene coordinates; nullopt if rendering failed.
std::optional<render::Image> drawStoreyPlan(const scene::Scene& scene, const StoreyFloor& storey,
                                            const PlanRenderer& renderPlan);

/// Writes the same plan as a page to scale 1:`scale`, a .svg or .pdf file; false if rendering
/// failed. Throws std::runtime_error if the file cannot be written.
bool writeStoreyPage(const scene::Scene& scene, const StoreyFloor& storey,
                     const PlanRenderer& renderPlan, double scale,
                     const std::filesystem::path& file);

}  // namespace enfilade::server
