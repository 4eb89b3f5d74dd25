// Floor plans per storey with coordinates on the frame, for writing scripts.
#pragma once

#include <filesystem>
#include <optional>

#include "scene/world/data/scene.hpp"
#include "server/floors/storeys.hpp"
#include "server/plans/plan_image.hpp"

namespace enfilade::server {

/// Draws the plan of one storey in a frame with scene coordinates; nullopt if rendering failed.
std::optional<render::Image> drawStoreyPlan(const scene::Scene& scene, const StoreyFloor& storey,
                                            const PlanRenderer& renderPlan);

/// Writes the same plan as a page to scale 1:`scale`, a .svg or .pdf file; false if rendering
/// failed. Throws std::runtime_error if the file cannot be written.
bool writeStoreyPage(const scene::Scene& scene, const StoreyFloor& storey,
                     const PlanRenderer& renderPlan, double scale,
                     const std::filesystem::path& file);

}  // namespace enfilade::server
