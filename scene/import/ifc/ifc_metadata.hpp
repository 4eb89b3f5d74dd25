// Metadata of an IFC file's products: names, classes, placements, hierarchy, door operations and
// opening fillings. Read from the text and not from a geometry reader, so that ids and names do not
// depend on the reader.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/step_file.hpp"
#include "scene/import/ifc/ifc_units.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// An IfcProduct of the file.
struct IfcProduct {
  /// Meaning of the product's body. Only `physical` is solid.
  enum class Role : std::uint8_t { physical, space, opening, drawing };

  std::uint32_t id = 0;  ///< express id: the number after '#'
  Role role = Role::physical;
  bool hasBody = false;  ///< its representation declares surfaces or solids
  std::string globalId;
  std::string ifcClass;       ///< as "IfcDoor"
  std::string name;           ///< UTF-8, may be empty
  std::string longName;       ///< of storeys and spaces: UTF-8, may be empty
  double elevation = 0;       ///< metres; of storeys: as stated, relative to the building
  std::string operation;      ///< of doors, windows, elevators; see Object::operation
  std::uint32_t parent = 0;   ///< its aggregate or spatial container; 0: no parent
  std::uint32_t opening = 0;  ///< doors and windows: the opening that they fill
  std::uint32_t host = 0;     ///< doors and windows: the element with that opening
  double overallWidth = 0, overallHeight = 0;        ///< metres; 0: not stated
  std::optional<Eigen::Affine3d> fileFromPlacement;  ///< metres, the file's axes, no scale
};

/// Metadata of the whole file.
struct IfcMetadata {
  double metresPerUnit = 1;
  std::optional<std::string> unitAssumption;  ///< the reason if the unit is assumed
  bool siUnit = true;                         ///< false: feet and other conversion-based units
  std::optional<IfcMapConversion> mapConversion;
  std::string mapFault;  ///< the reason if the file states a map that cannot be used
  /// Horizontal direction of north in the file's axes: of its context, otherwise of its map,
  /// otherwise y. nullopt: none of these can be used.
  std::optional<Vec3> trueNorth;
  std::string schema;
  bool complete = true;                           ///< END-ISO-10303-21 is present
  std::vector<IfcProduct> products;               ///< in file order; one per express id
  std::map<std::uint32_t, std::size_t> byId;      ///< index into products
  std::map<std::uint32_t, std::string> projects;  ///< names; projects are not products
  std::vector<Diagnostic> diagnostics;

  const IfcProduct* find(std::uint32_t id) const;
};

/// Never throws on file contents; missing values stay empty.
IfcMetadata readIfcMetadata(const StepFile& file);

/// A placement's transform to the file's world, in metres and the file's axes; nullopt if invalid.
std::optional<Eigen::Affine3d> readIfcPlacement(const StepFile& file, std::uint32_t placement,
                                                double metresPerUnit);

}  // namespace enfilade::scene
