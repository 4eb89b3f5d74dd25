// Reads the length unit and the map georeference of an IFC file.
#pragma once

#include <optional>
#include <string>

#include "scene/import/ifc/step_file.hpp"

namespace enfilade::scene {

/// The file's map georeference (IfcMapConversion). Reported, but not applied: the model keeps its
/// own coordinates.
struct IfcMapConversion {
  std::string crs;                         ///< the map's name, e.g. "EPSG:25832"; may be empty
  double east = 0, north = 0, height = 0;  ///< of the file's origin, metres
  double rotation = 0;                     ///< of the file's x axis, from east to north, radians
  double scale = 1;                        ///< from the file's lengths to the map's
};

/// Metres per length unit of the project; nullopt: not stated. Sets `siUnit`.
std::optional<double> readIfcMetresPerUnit(const StepFile& file, bool& siUnit);

/// The map georeference; nullopt: absent or invalid. Lengths are converted to metres by the map's
/// unit, or by `metresPerUnit` if the map has no unit.
std::optional<IfcMapConversion> readIfcMapConversion(const StepFile& file, double metresPerUnit);

}  // namespace enfilade::scene
