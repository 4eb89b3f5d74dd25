// What the text of an IFC file says of its products, whoever reads their shapes: names, classes,
// places in the building, doors' ways of opening, what fills which opening. Taken from the text and
// not from a reader, so that ids and names are the same with each of them.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "scene/import/ifc/step_file.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

struct IfcProduct {
  /// What its body stands for. Only `thing` is solid.
  enum class Role : std::uint8_t { thing, space, opening, drawing };

  std::uint32_t id = 0;  ///< express id: the number behind '#'
  Role role = Role::thing;
  bool hasBody = false;  ///< its representation promises surfaces or solids
  std::string globalId;
  std::string ifcClass;       ///< as "IfcDoor"
  std::string name;           ///< UTF-8, may be empty
  std::string operation;      ///< of doors, windows, lifts; see Object::operation
  std::uint32_t parent = 0;   ///< what it belongs to or is contained in; 0: nothing
  std::uint32_t opening = 0;  ///< doors and windows: what they fill
  std::uint32_t host = 0;     ///< doors and windows: whose opening that is
  double overallWidth = 0, overallHeight = 0;        ///< metres, 0: not told
  std::optional<Eigen::Affine3d> fileFromPlacement;  ///< metres, the file's axes, no scale
};

/// Where the file's coordinates lie on a map (IfcMapConversion). Told, not heeded: a model stays in
/// its own coordinates.
struct IfcMapPlace {
  std::string crs;                         ///< the map's name, as "EPSG:25832"; may be empty
  double east = 0, north = 0, height = 0;  ///< of the file's origin, metres
  double turn = 0;                         ///< of the file's x axis from east to north, radians
  double scale = 1;                        ///< from the file's lengths to the map's
};

struct IfcFacts {
  double metresPerUnit = 1;
  std::optional<std::string> unitGuessed;  ///< why the unit is a guess
  bool siUnit = true;                      ///< false: feet and the like
  std::optional<IfcMapPlace> mapPlace;
  std::string schema;
  bool whole = true;                              ///< END-ISO-10303-21 is there
  std::vector<IfcProduct> products;               ///< in file order; one an express id
  std::map<std::uint32_t, std::size_t> byId;      ///< into products
  std::map<std::uint32_t, std::string> projects;  ///< their names; they are no products
  std::vector<Problem> problems;

  const IfcProduct* find(std::uint32_t id) const;
};

/// Never throws for what a file may hold; what is missing is missing.
IfcFacts readIfcFacts(const StepFile& file);

/// Metres in the length unit of the project; nullopt: none is told.
std::optional<double> ifcMetresPerUnit(const StepFile& file, bool& siUnit);

/// nullopt: the file tells of no place on a map, or of none that can be. Metres come of the map's
/// unit, or of `metresPerUnit` where the map has none.
std::optional<IfcMapPlace> ifcMapPlace(const StepFile& file, double metresPerUnit);

/// "IFCWALLSTANDARDCASE" as "IfcWallStandardCase".
std::string ifcClassName(std::string_view type);

/// Where a placement lies in the world, in metres and the file's axes; nullopt when it is broken.
std::optional<Eigen::Affine3d> ifcPlacement(const StepFile& file, std::uint32_t placement,
                                            double metresPerUnit);

}  // namespace enfilade::scene
