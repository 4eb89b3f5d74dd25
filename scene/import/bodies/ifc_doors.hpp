// Doors of IFC as bodies: which way they open is told by their OperationType, seen in the door's
// own placement (IfcDoorStyleOperationEnum, IfcDoorTypeOperationEnum: hinges left or right as seen
// along the positive y axis, to which side the door opens).
#pragma once

#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Takes each door of the model apart, where that can be done: the door's object keeps its leaf,
/// the frame becomes an object PATH/frame at the end of the list, a second leaf PATH/leaf2, both
/// pieces of the door. Returns the bodies that the leaves are, for whom a higher source leaves
/// them. Counts in the model's problems `guessed_doors`, whose file does not say how they open, and
/// `still_doors`, which stay as they were.
std::vector<BodySpec> splitDoors(Model& model);

}  // namespace enfilade::scene
