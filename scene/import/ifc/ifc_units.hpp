// Reads the length unit and the map georeference of an IFC file.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "scene/import/file/step_file.hpp"

namespace enfilade::scene {

/// The file's map georeference (IfcMapConversion). Reported, and applied on request: otherwise the
/// model keeps its own coordinates.
struct IfcMapConversion {
  std::string crs;                         ///< the map's name, e.g. "EPSG:25832"; may be empty
  double east = 0, north = 0, height = 0;  ///< of the file's origin, metres
  double xAxisEast = 1, xAxisNorth = 0;    ///< direction of the file's x axis, unit
  double rotation = 0;                     ///< its angle, from east to north, radians
  double scale = 1;  ///< from metres of the file to metres of the map; about 1
};

/// Metres per length unit of the project; nullopt: not stated. Sets `siUnit`.
std::optional<double> readIfcMetresPerUnit(const StepFile& file, bool& siUnit);

/// The map georeference; nullopt: absent or invalid. Lengths are converted to metres by the map's
/// unit, or by `metresPerUnit` if the map has no unit.
std::optional<IfcMapConversion> readIfcMapConversion(const StepFile& file, double metresPerUnit);

/// To the map's axes (x east, y north, z up) from the file's, both in metres.
Eigen::Affine3d computeMapFromFile(const IfcMapConversion& conversion);

}  // namespace enfilade::scene
