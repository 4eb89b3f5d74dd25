// Reads the length unit and the map georeference of an IFC file.
#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <string>

#include "scene/import/file/step_file.hpp"

namespace enfilade::scene {

/// The file's map georeference. Reported, and applied on request: otherwise the model keeps its own
/// coordinates.
struct IfcMapConversion {
  std::string source;  ///< what states it: "IfcMapConversion", "IfcRigidOperation", ..
  std::string crs;     ///< the map's name, e.g. "EPSG:25832"; may be empty
  double east = 0, north = 0, height = 0;  ///< of the file's origin, metres
  double xAxisEast = 1, xAxisNorth = 0;    ///< direction of the file's x axis, unit
  double rotation = 0;                     ///< its angle, from east to north, radians
  double scale = 1;  ///< from metres of the file to metres of the map; about 1
  /// Further factors of the file's axes (IfcMapConversionScaled), about 1.
  Eigen::Vector3d axisScale = Eigen::Vector3d::Ones();
};

/// Metres per length unit of the project; nullopt: not stated. Sets `siUnit`.
std::optional<double> readIfcMetresPerUnit(const StepFile& file, bool& siUnit);

/// The map georeference; nullopt: absent, or invalid, which sets `fault`. Read from
/// IfcMapConversion(Scaled), otherwise IfcRigidOperation, otherwise the property set
/// ePSet_MapConversion of IFC2x3. Lengths are converted to metres by the map's unit, or by
/// `metresPerUnit` if the map has no unit.
std::optional<IfcMapConversion> readIfcMapConversion(const StepFile& file, double metresPerUnit,
                                                     std::string& fault);

/// To the map's axes (x east, y north, z up) from the file's, both in metres.
Eigen::Affine3d computeMapFromFile(const IfcMapConversion& conversion);

/// North of the map in the file's axes: unit length, horizontal.
Eigen::Vector3d computeGridNorth(const IfcMapConversion& conversion);

/// For people: where the file's origin lies.
std::string formatMapConversion(const IfcMapConversion& conversion);

/// The map that --georeference applies. Throws ImportError without one, or unless it scales about
/// as a projection does. `fault`: of readIfcMapConversion().
const IfcMapConversion& requireMap(const std::optional<IfcMapConversion>& conversion,
                                   const std::string& fault);

}  // namespace enfilade::scene
