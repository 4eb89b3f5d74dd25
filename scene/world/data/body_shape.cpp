// Builds the collision shape and mass properties of a body. Steps:
//  1. Split each object into shells (shapes/shape.hpp), once for all objects with the same meshes.
//     A closed convex shell becomes its hull, by the rule for static objects.
//  2. Kinematic bodies keep the other shells as triangles. In rigid bodies and triggers, shells
//     connected by shared vertices become one hull. It counts as approximate where it is larger
//     than its shells.
//  3. Compute the mass properties of the hulls (shapes/mass_properties.hpp).
#include "scene/world/data/body_shape.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <stdexcept>

#include "scene/base/disjoint_sets.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/model/shapes/mass_properties.hpp"
#include "scene/model/shapes/mesh_to_hull.hpp"

namespace enfilade::scene {
namespace {

using collision::Hull;
using collision::Triangle;

constexpr double kMinThickness = 1e-3;  // metres: thickness assumed for the mass of sheets

const Shape& findOrBuildShape(const Model& model, const std::vector<std::uint32_t>& meshes,
                              MeshShapeCache& cache) {
  const auto found = cache.find(meshes);
  if (found != cache.end()) return found->second;
  return cache.emplace(meshes, buildShape(model.meshes, meshes)).first->second;
}

std::vector<PlacedShape> collectShapes(const Model& model, const BodySpec& spec,
                                       MeshShapeCache& cache) {
  std::vector<PlacedShape> shapes;
  for (const std::uint32_t index : spec.objects) {
    const Object& object = model.objects[index];
    if (object.usage == Object::Usage::visualOnly) continue;
    shapes.push_back({findOrBuildShape(model, object.meshes, cache), object.worldFromMesh});
  }
  return shapes;
}

/// Groups the shells that share vertices, in order of the first shell of each group.
std::vector<std::vector<std::uint32_t>> findConnectedPieces(const Shape& shape) {
  const auto count = static_cast<std::uint32_t>(shape.shells.size());
  DisjointSets sets(count);
  std::vector<std::uint32_t> shellOfVertex(shape.vertices.size(), count);
  for (std::uint32_t s = 0; s < count; ++s) {
    const Shell& shell = shape.shells[s];
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      for (const std::uint32_t vertex : shape.triangles[t]) {
        std::uint32_t& other = shellOfVertex[vertex];
        if (other == count) other = s;
        sets.unite(other, s);
      }
    }
  }
  std::vector<std::vector<std::uint32_t>> pieces(count);
  for (std::uint32_t s = 0; s < count; ++s) pieces[sets.find(s)].push_back(s);
  std::erase_if(pieces, [](const auto& piece) { return piece.empty(); });
  return pieces;
}

class ShapeBuilder {
 public:
  ShapeBuilder(const Vec3& origin, bool keepsTriangles, BodyShape& shape)
      : origin_(origin), keepsTriangles_(keepsTriangles), shape_(shape) {}

  void addShape(const PlacedShape& placed) {
    for (const std::vector<std::uint32_t>& piece : findConnectedPieces(placed.shape)) {
      if (keepsTriangles_) {
        for (const std::uint32_t s : piece) addKinematicShell(placed, placed.shape.shells[s]);
      } else {
        addSolidPiece(placed, piece);
      }
    }
  }

 private:
  void addKinematicShell(const PlacedShape& placed, const Shell& shell) {
    if (isTreatedAsHull(placed, shell)) return addHull(placed, {&shell, 1});
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t)
      if (const auto corners = toBodyFrame(placed.triangle(t)); hasNumericalArea(corners))
        shape_.parts.push_back(collision::buildHull(corners));
  }

  /// Adds one hull for the piece, or one per shell if all shells are convex already.
  void addSolidPiece(const PlacedShape& placed, const std::vector<std::uint32_t>& piece) {
    std::vector<Shell> shells;
    for (const std::uint32_t s : piece) shells.push_back(placed.shape.shells[s]);
    const bool exact = std::all_of(shells.begin(), shells.end(), [](const Shell& shell) {
      return (shell.isConvex() && !shell.hollow) || shell.count == 1;
    });
    if (!exact) {
      ++shape_.approximateCount;
      return addHull(placed, shells);
    }
    for (const Shell& shell : shells) addHull(placed, {&shell, 1});
  }

  void addHull(const PlacedShape& placed, std::span<const Shell> shells) {
    ++shape_.hullCount;
    shape_.parts.push_back(buildShellHull(placed, shells, origin_));
  }

  Triangle toBodyFrame(Triangle triangle) const {
    for (Vec3& corner : triangle) corner -= origin_;
    return triangle;
  }

  Vec3 origin_;
  bool keepsTriangles_;
  BodyShape& shape_;
};

/// Mass properties of a solid box, for bodies whose parts are all flat.
MassProperties makeBoxMass(const Aabb& box, double density) {
  const Vec3 size = box.size().cwiseMax(kMinThickness), square = size.cwiseProduct(size);
  MassProperties mass;
  mass.volume = size.prod();
  mass.mass = density * mass.volume;
  mass.centre = box.centre();
  mass.inertia.diagonal() = mass.mass / 12 * (Vec3::Constant(square.sum()) - square);
  return mass;
}

MassProperties computeBodyMass(const BodySpec& spec, const BodyShape& shape) {
  std::vector<MassProperties> parts;
  for (const Hull& hull : shape.parts) {
    if (hull.faces.size() < 4) continue;  // flat
    try {
      parts.push_back(computeHullMass(hull, spec.density));
    } catch (const std::invalid_argument&) {
      // Numerically flat: no volume.
    }
  }
  const double minVolume = kMinThickness * kMinThickness * kMinThickness;
  MassProperties mass;
  if (!parts.empty()) mass = combineMassProperties(parts);
  if (!(mass.volume > minVolume)) mass = makeBoxMass(shape.box, spec.density);
  return spec.mass ? scaleToMass(mass, *spec.mass) : mass;
}

/// Sets the mass properties and moves the frame's origin to the centre of mass.
void assignMass(const BodySpec& spec, BodyShape& shape) {
  const MassProperties mass = computeBodyMass(spec, shape);
  shape.volume = mass.volume;
  shape.mass = mass.mass;
  shape.inertia = mass.inertia;
  shape.origin += mass.centre;
  for (Hull& hull : shape.parts)
    for (Vec3& vertex : hull.vertices) vertex -= mass.centre;
}

void computeExtents(BodyShape& shape) {
  shape.box = {};
  shape.radius = 0;
  for (Hull& hull : shape.parts) {
    hull.radius = 0;
    for (const Vec3& vertex : hull.vertices) {
      shape.box.include(vertex);
      hull.radius = std::max(hull.radius, vertex.norm());
    }
    shape.radius = std::max(shape.radius, hull.radius);
  }
  shape.radius *= 1 + 0x1p-48;
}

void buildSupportTables(BodyShape& shape) {
  std::vector<Vec3> points;
  for (const Hull& hull : shape.parts) {
    const bool isSingle = shape.parts.size() == 1;
    shape.partSupports.push_back(collision::buildSupportTable(
        hull, isSingle ? collision::chooseAabbMethod(hull) : collision::chooseTightMethod(hull)));
    points.insert(points.end(), hull.vertices.begin(), hull.vertices.end());
  }
  if (shape.parts.size() == 1) return;
  shape.outline = collision::buildHull(points);
  shape.outlineSupport = collision::buildSupportTable(shape.outline);
}

}  // namespace

BodyShape buildBodyShape(const Model& model, const BodySpec& spec, MeshShapeCache& cache) {
  const std::vector<PlacedShape> shapes = collectShapes(model, spec, cache);
  BodyShape shape;
  shape.origin = spec.anchor;
  if (isDynamic(spec.kind)) {
    Aabb box;
    for (const PlacedShape& placed : shapes)
      for (std::uint32_t v = 0; v < placed.shape.vertices.size(); ++v)
        box.include(placed.vertexPosition(v));
    if (!box.empty()) shape.origin = box.centre();  // until the centre of mass is known
  }
  ShapeBuilder builder(shape.origin, isKinematic(spec.kind), shape);
  for (const PlacedShape& placed : shapes) builder.addShape(placed);
  if (shape.parts.empty())
    throw std::invalid_argument("body '" + spec.name + "': its objects have no triangles; '" +
                                model.objects[spec.objects[0]].path + "' is its first object");
  computeExtents(shape);
  if (isDynamic(spec.kind)) {
    assignMass(spec, shape);
    computeExtents(shape);
  }
  std::vector<Aabb> boxes;
  for (const Hull& hull : shape.parts)
    for (Aabb& box = boxes.emplace_back(); const Vec3& vertex : hull.vertices) box.include(vertex);
  shape.tree = collision::buildBoxTree(boxes, 1);
  buildSupportTables(shape);
  return shape;
}

Eigen::Affine3d computeWorldFromAuthored(const BodyShape& shape,
                                         const collision::Pose& worldFromBody) {
  Eigen::Affine3d worldFromAuthored = Eigen::Affine3d::Identity();
  worldFromAuthored.translate(worldFromBody.translation)
      .rotate(worldFromBody.rotation)
      .translate(-shape.origin);
  return worldFromAuthored;
}

collision::CompoundView makeCompoundView(const BodyShape& shape,
                                         const collision::Pose& worldFromBody) {
  const auto rotation =
      std::make_shared<const collision::Mat3>(worldFromBody.rotation.toRotationMatrix());
  const Vec3 translation = worldFromBody.translation;
  return {&shape.tree, *rotation, translation, [&shape, rotation, translation](std::uint32_t item) {
            const Hull& hull = shape.parts[shape.tree.order[item]];
            return collision::PlacedConvex{hull.vertices, translation, rotation.get(), &hull};
          }};
}

}  // namespace enfilade::scene
