// The space of a model, such as a room, that contains a point.
#pragma once

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The space whose solid contains `point` (scene frame, metres), otherwise the nearest one within
/// `reach` metres. Of several at one distance the one of the smallest floor area, and of these the
/// first; null: none. Takes time with the triangles of the spaces whose boxes are that near.
const Space* findSpace(const Model& model, const Vec3& point, double reach);

}  // namespace enfilade::scene
