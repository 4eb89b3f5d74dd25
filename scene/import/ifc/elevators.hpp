// Converts IFC elevators to bodies. A file states only the cabin and that it is an elevator. Its
// stops are computed: all storeys that the cabin reaches through an open shaft from the storey at
// which it was drawn. Vertical lines from a grid of points in the cabin's outline find the
// obstacles that close the shaft.
#pragma once

#include <vector>

#include "scene/import/ifc/ifc_metadata.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Adds a body for each elevator whose stops can be determined; reports the others as
/// `still_lifts`.
void findElevators(Model& model, const IfcMetadata& metadata, std::vector<Diagnostic>& diagnostics);

}  // namespace enfilade::scene
