// Storeys and spaces of an IFC file: what contains a product, and where rooms are.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/ifc/ifc_meshes.hpp"
#include "scene/import/ifc/ifc_metadata.hpp"

namespace enfilade::scene {

/// The storeys of a file, and the storey of each product.
class StoreyTable {
 public:
  explicit StoreyTable(const IfcMetadata& metadata);

  /// Express ids, ascending elevations: indices into Model::storeys.
  const std::vector<std::uint32_t>& storeys() const { return storeys_; }
  /// The storey of a product: that of its container, of its whole or, of doors and windows, of the
  /// wall that they are in. nullopt: none.
  std::optional<std::uint32_t> find(const IfcProduct& product) const;
  /// The origin of a storey in the file's axes, metres: of its placement, otherwise as stated.
  Vec3 findOrigin(const IfcProduct& storey) const;
  /// Whether all storeys are placed at one height, which their stated elevations contradict. Then
  /// the elevations count.
  bool isByElevation() const { return isByElevation_; }

 private:
  const IfcMetadata& metadata_;
  std::vector<std::uint32_t> storeys_;
  std::map<std::uint32_t, std::uint32_t> indexById_;
  bool isByElevation_ = false;
};

/// Unique path of each product from the project down, by express id.
std::map<std::uint32_t, std::string> buildIfcPaths(const IfcMetadata& metadata);

/// Adds storeys, spaces and north to a model that is otherwise complete. `meshes` may have the
/// spaces' geometry. The transforms lead to the scene's frame before its offset is subtracted.
void addSpatialStructure(const IfcMetadata& metadata, const StoreyTable& storeys,
                         const IfcMeshes& meshes, const Eigen::Affine3d& worldFromFile,
                         const Eigen::Affine3d& worldFromReader, Model& model);

}  // namespace enfilade::scene
