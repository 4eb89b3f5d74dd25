// Doors of IFC as bodies. Their OperationType gives the direction of opening, in the frame of the
// door's placement (IfcDoorStyleOperationEnum, IfcDoorTypeOperationEnum). Hinges are left or right
// as seen along the positive y axis, to which the door opens.
#pragma once

#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Splits each door of the model where that is possible. The door's object keeps the leaf; the
/// frame becomes an object PATH/frame at the end of the list, a second leaf PATH/leaf2. Both are
/// parts of the door. Returns the bodies of the leaves, which sources of higher priority may
/// replace. Counts `still_doors` (left unchanged) and, if they open, `guessed_doors` (the file does
/// not say how).
std::vector<BodySpec> splitDoors(Model& model, bool theyOpen);

}  // namespace enfilade::scene
