// Steps
//  1. Each object of the body is split into surfaces (shapes/shape.hpp), once for all objects of
//  the
//     same meshes. A closed convex one becomes its hull, by the rule that still objects have.
//  2. The rest stays triangles in kinematic bodies. In rigid bodies and triggers, surfaces that
//     hang together by shared corners become one hull, which is counted where it is larger than
//     they are.
//  3. Mass: that of the hulls (shapes/mass_properties.hpp).
#include "scene/world/data/body_shape.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>
#include <stdexcept>

#include "scene/model/shapes/mass_properties.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::scene {
namespace {

using collision::Hull;
using collision::Triangle;

constexpr double kLeastThick = 1e-3;  // metres: sheets have mass as if they were so thick

/// One object of the body: what it is made of, and where.
struct PlacedShape {
  const Shape& shape;
  Eigen::Affine3d worldFromMesh;

  /// A corner where the body was authored, by the expression of worldPosition().
  Vec3 at(std::uint32_t vertex) const {
    return worldFromMesh * shape.vertices[vertex].cast<double>();
  }
  Triangle triangle(std::size_t t) const {
    const auto& corners = shape.triangles[t];
    return {at(corners[0]), at(corners[1]), at(corners[2])};
  }
};

const Shape& shapeOf(const Model& model, const std::vector<std::uint32_t>& meshes,
                     ShapesOfMeshes& known) {
  const auto found = known.find(meshes);
  if (found != known.end()) return found->second;
  return known.emplace(meshes, shapeOf(model.meshes, meshes)).first->second;
}

std::vector<PlacedShape> shapesOf(const Model& model, const BodySpec& spec, ShapesOfMeshes& known) {
  std::vector<PlacedShape> shapes;
  for (const std::uint32_t index : spec.objects) {
    const Object& object = model.objects[index];
    if (object.use == Object::Use::drawn) continue;
    shapes.push_back({shapeOf(model, object.meshes, known), object.worldFromMesh});
  }
  return shapes;
}

/// Shells that hang together by shared corners, in order of their first ones.
std::vector<std::vector<std::uint32_t>> piecesOf(const Shape& shape) {
  const auto count = static_cast<std::uint32_t>(shape.shells.size());
  std::vector<std::uint32_t> parent(count), shellOfVertex(shape.vertices.size(), count);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto rootOf = [&](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (std::uint32_t s = 0; s < count; ++s) {
    const Shell& shell = shape.shells[s];
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t) {
      for (const std::uint32_t vertex : shape.triangles[t]) {
        std::uint32_t& other = shellOfVertex[vertex];
        if (other == count) other = s;
        const std::uint32_t a = rootOf(other), b = rootOf(s);
        parent[std::max(a, b)] = std::min(a, b);
      }
    }
  }
  std::vector<std::vector<std::uint32_t>> pieces(count);
  for (std::uint32_t s = 0; s < count; ++s) pieces[rootOf(s)].push_back(s);
  std::erase_if(pieces, [](const auto& piece) { return piece.empty(); });
  return pieces;
}

class ShapeBuilder {
 public:
  ShapeBuilder(const Vec3& origin, bool keepsTriangles, BodyShape& into)
      : origin_(origin), keepsTriangles_(keepsTriangles), into_(into) {}

  void add(const PlacedShape& placed) {
    for (const std::vector<std::uint32_t>& piece : piecesOf(placed.shape)) {
      if (keepsTriangles_) {
        for (const std::uint32_t s : piece) addKinematic(placed, placed.shape.shells[s]);
      } else {
        addSolid(placed, piece);
      }
    }
  }

 private:
  void addKinematic(const PlacedShape& placed, const Shell& shell) {
    if (becomesHull(placed.shape, shell, placed.worldFromMesh)) return addHull(placed, {&shell, 1});
    for (std::size_t t = shell.first; t < shell.first + shell.count; ++t)
      if (const auto corners = relative(placed.triangle(t)); hasArea(corners))
        into_.parts.push_back(collision::buildHull(corners));
  }

  /// Convex solids that only share a corner or an edge stay what they are.
  void addSolid(const PlacedShape& placed, const std::vector<std::uint32_t>& piece) {
    std::vector<Shell> shells;
    for (const std::uint32_t s : piece) shells.push_back(placed.shape.shells[s]);
    const bool exact = std::all_of(shells.begin(), shells.end(), [](const Shell& shell) {
      return (shell.isConvex() && !shell.hollow) || shell.count == 1;
    });
    if (!exact) {
      ++into_.approximate;
      return addHull(placed, shells);
    }
    for (const Shell& shell : shells) addHull(placed, {&shell, 1});
  }

  void addHull(const PlacedShape& placed, std::span<const Shell> shells) {
    std::vector<Vec3> points;
    for (const std::uint32_t v : verticesOf(placed.shape, shells))
      points.emplace_back(placed.at(v) - origin_);
    ++into_.hulls;
    into_.parts.push_back(collision::buildHull(points));
  }

  Triangle relative(Triangle triangle) const {
    for (Vec3& corner : triangle) corner -= origin_;
    return triangle;
  }

  Vec3 origin_;
  bool keepsTriangles_;
  BodyShape& into_;
};

/// A solid box of this mass, for bodies whose parts are all flat.
MassProperties boxOfMass(const Box& box, double density) {
  const Vec3 size = box.size().cwiseMax(kLeastThick), square = size.cwiseProduct(size);
  MassProperties mass;
  mass.volume = size.prod();
  mass.mass = density * mass.volume;
  mass.centre = box.centre();
  mass.inertia.diagonal() = mass.mass / 12 * (Vec3::Constant(square.sum()) - square);
  return mass;
}

MassProperties massOf(const BodySpec& spec, const BodyShape& shape) {
  std::vector<MassProperties> parts;
  for (const Hull& hull : shape.parts) {
    if (hull.faces.size() < 4) continue;  // flat
    try {
      parts.push_back(massOfHull(hull, spec.density));
    } catch (const std::invalid_argument&) {
      // As good as flat.
    }
  }
  const double least = kLeastThick * kLeastThick * kLeastThick;
  MassProperties mass;
  if (!parts.empty()) mass = together(parts);
  if (!(mass.volume > least)) mass = boxOfMass(shape.box, spec.density);
  return spec.mass ? withMass(mass, *spec.mass) : mass;
}

/// Moves the frame's origin to the centre of mass, and says how the mass lies about it.
void weigh(const BodySpec& spec, BodyShape& shape) {
  const MassProperties mass = massOf(spec, shape);
  shape.volume = mass.volume;
  shape.mass = mass.mass;
  shape.inertia = mass.inertia;
  shape.origin += mass.centre;
  for (Hull& hull : shape.parts)
    for (Vec3& vertex : hull.vertices) vertex -= mass.centre;
}

void measure(BodyShape& shape) {
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

}  // namespace

BodyShape shapeOf(const Model& model, const BodySpec& spec, ShapesOfMeshes& known) {
  const std::vector<PlacedShape> shapes = shapesOf(model, spec, known);
  BodyShape shape;
  shape.origin = spec.anchor;
  if (spec.kind == BodyKind::rigid) {
    Box box;
    for (const PlacedShape& placed : shapes)
      for (std::uint32_t v = 0; v < placed.shape.vertices.size(); ++v) box.include(placed.at(v));
    if (!box.empty()) shape.origin = box.centre();  // near by, until the centre of mass is known
  }
  ShapeBuilder builder(shape.origin, isKinematic(spec.kind), shape);
  for (const PlacedShape& placed : shapes) builder.add(placed);
  if (shape.parts.empty())
    throw std::invalid_argument("body '" + spec.name + "': its objects have no triangles; '" +
                                model.objects[spec.objects[0]].path + "' is the first of them");
  measure(shape);
  if (spec.kind == BodyKind::rigid) {
    weigh(spec, shape);
    measure(shape);
  }
  std::vector<Box> boxes;
  for (const Hull& hull : shape.parts)
    for (Box& box = boxes.emplace_back(); const Vec3& vertex : hull.vertices) box.include(vertex);
  shape.tree = collision::buildBoxTree(boxes, 1);
  return shape;
}

collision::TreeOfParts treeAt(const BodyShape& shape, const collision::Pose& worldFromBody) {
  const auto rotation =
      std::make_shared<const collision::Mat3>(worldFromBody.rotation.toRotationMatrix());
  const Vec3 translation = worldFromBody.translation;
  return {&shape.tree, *rotation, translation, [&shape, rotation, translation](std::uint32_t item) {
            const Hull& hull = shape.parts[shape.tree.order[item]];
            return collision::ConvexBody{hull.vertices, translation, rotation.get(), &hull};
          }};
}

}  // namespace enfilade::scene
