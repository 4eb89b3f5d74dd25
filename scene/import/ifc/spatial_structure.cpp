#include "scene/import/ifc/spatial_structure.hpp"

#include <algorithm>
#include <utility>

#include "scene/import/assembly/path_names.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxContainers = 100;  // around a product; files may have rings
constexpr int kMaxPathDepth = 100;   // levels from the project to a product

bool isStorey(const IfcProduct& product) {
  return product.ifcClass == "IfcBuildingStorey";
}

/// The corners of the triangles, relative to `offset` in the scene's axes; empty without geometry.
std::vector<Vec3> collectSpaceSurface(const IfcMeshes& meshes, std::uint32_t space,
                                      const Eigen::Affine3d& worldFromReader, const Vec3& offset) {
  std::vector<Vec3> corners;
  const auto found = meshes.products.find(space);
  if (found == meshes.products.end()) return corners;
  for (const IfcPlacedGeometry& placed : found->second) {
    const Eigen::Affine3d transform = worldFromReader * placed.worldFromGeometry;
    const IfcGeometry& geometry = meshes.geometries.at(placed.geometry);
    for (const std::uint32_t index : geometry.indices)
      corners.push_back(transform * geometry.positions[index].cast<double>() - offset);
  }
  return corners;
}

/// North in the scene's horizontal plane; nullopt if it is unknown, or an --up axis turned it
/// upright.
std::optional<Eigen::Vector2d> computeSceneNorth(const std::optional<Vec3>& trueNorth,
                                                 const Eigen::Affine3d& worldFromFile) {
  if (!trueNorth) return std::nullopt;
  const Vec3 north = (worldFromFile.linear() * *trueNorth).normalized();
  const Eigen::Vector2d level(north.x(), north.z());
  return level.norm() > 0.99 ? std::optional<Eigen::Vector2d>(level.normalized()) : std::nullopt;
}

class PathBuilder {
 public:
  explicit PathBuilder(const IfcMetadata& metadata) : metadata_(metadata) {}

  const std::string& buildPath(std::uint32_t id, int depth = 0) {
    const auto known = paths_.find(id);
    if (known != paths_.end()) return known->second;
    const IfcProduct* product = metadata_.find(id);
    const std::uint32_t parent = product == nullptr ? 0 : findParent(*product, depth);
    const std::string above = parent == 0 ? std::string() : buildPath(parent, depth + 1) + "/";
    return paths_[id] = above + siblings_[parent].makeUnique(makePathSegment(id, product));
  }
  std::map<std::uint32_t, std::string> takePaths() { return std::move(paths_); }

 private:
  std::uint32_t findParent(const IfcProduct& product, int depth) const {
    const bool known =
        metadata_.find(product.parent) != nullptr || metadata_.projects.contains(product.parent);
    return known && product.parent != product.id && depth < kMaxPathDepth ? product.parent : 0;
  }
  std::string makePathSegment(std::uint32_t id, const IfcProduct* product) const {
    const auto project = metadata_.projects.find(id);
    const std::string& name = product != nullptr ? product->name : project->second;
    if (!name.empty()) return encodePathSegment(name);
    return product != nullptr ? product->ifcClass : "IfcProject";
  }

  const IfcMetadata& metadata_;
  std::map<std::uint32_t, std::string> paths_;
  std::map<std::uint32_t, SiblingNames> siblings_;
};

/// Whether the triangles' areas cancel, as those of the surface of a solid do in each direction.
bool isClosed(const std::vector<Vec3>& corners) {
  constexpr double kMaxShare = 1e-6;  // of the surface
  Vec3 sum = Vec3::Zero();
  double total = 0;
  for (std::size_t i = 0; i + 2 < corners.size(); i += 3) {
    const Vec3 area = (corners[i + 1] - corners[i]).cross(corners[i + 2] - corners[i]);
    sum += area;
    total += area.norm();
  }
  return sum.norm() <= kMaxShare * total;
}

/// Whether all storeys are placed at one height although their elevations differ.
bool contradictsElevations(const IfcMetadata& metadata) {
  std::vector<double> heights, elevations;
  for (const IfcProduct& product : metadata.products) {
    if (!isStorey(product)) continue;
    if (!product.fileFromPlacement) return false;
    heights.push_back(product.fileFromPlacement->translation().z());
    elevations.push_back(product.elevation);
  }
  const auto areEqual = [](const std::vector<double>& values) {
    const auto [min, max] = std::ranges::minmax(values);
    return max - min <= 1e-6;  // metres
  };
  return !heights.empty() && areEqual(heights) && !areEqual(elevations);
}

}  // namespace

std::map<std::uint32_t, std::string> buildIfcPaths(const IfcMetadata& metadata) {
  PathBuilder paths(metadata);
  for (const IfcProduct& product : metadata.products) paths.buildPath(product.id);
  return paths.takePaths();
}

StoreyTable::StoreyTable(const IfcMetadata& metadata)
    : metadata_(metadata), isByElevation_(contradictsElevations(metadata)) {
  std::vector<std::pair<double, std::uint32_t>> order;
  for (const IfcProduct& product : metadata.products)
    if (isStorey(product)) order.emplace_back(findOrigin(product).z(), product.id);
  std::sort(order.begin(), order.end());
  for (const auto& [elevation, id] : order) {
    indexById_.emplace(id, static_cast<std::uint32_t>(storeys_.size()));
    storeys_.push_back(id);
  }
}

Vec3 StoreyTable::findOrigin(const IfcProduct& storey) const {
  const Vec3 stated(0, 0, storey.elevation);
  if (!storey.fileFromPlacement) return stated;
  return storey.fileFromPlacement->translation() + (isByElevation_ ? stated : Vec3::Zero());
}

std::optional<std::uint32_t> StoreyTable::find(const IfcProduct& product) const {
  const auto findAbove = [this](const IfcProduct* container) -> std::optional<std::uint32_t> {
    for (int depth = 0; container != nullptr && depth < kMaxContainers; ++depth) {
      const auto found = indexById_.find(container->id);
      if (found != indexById_.end()) return found->second;
      container = metadata_.find(container->parent != 0 ? container->parent : container->host);
    }
    return std::nullopt;
  };
  if (const auto storey = findAbove(&product)) return storey;
  // A door that the file puts into the building is in the storey of its wall.
  return product.host != 0 ? findAbove(metadata_.find(product.host)) : std::nullopt;
}

void addSpatialStructure(const IfcMetadata& metadata, const StoreyTable& storeys,
                         const IfcMeshes& meshes, const Eigen::Affine3d& worldFromFile,
                         const Eigen::Affine3d& worldFromReader, Model& model) {
  model.north = computeSceneNorth(metadata.trueNorth, worldFromFile);
  if (storeys.isByElevation())
    addDiagnostic(model.diagnostics, "storeys_by_elevation", "all storeys",
                  storeys.storeys().size());
  for (const std::uint32_t id : storeys.storeys()) {
    const IfcProduct& product = *metadata.find(id);
    model.storeys.push_back({product.name.empty() ? product.longName : product.name,
                             product.globalId,
                             (worldFromFile * storeys.findOrigin(product)).y() - model.offset.y()});
  }
  for (const IfcProduct& product : metadata.products) {
    if (product.role != IfcProduct::Role::space) continue;
    Space space{product.name, product.longName, product.globalId, storeys.find(product), {}};
    space.surface = collectSpaceSurface(meshes, product.id, worldFromReader, model.offset);
    for (const Vec3& corner : space.surface) space.box.include(corner);
    if (!isClosed(space.surface)) space.surface.clear();  // the box is the solid
    model.spaces.push_back(std::move(space));
  }
}

}  // namespace enfilade::scene
