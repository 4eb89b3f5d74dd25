// KHR_implicit_shapes as meshes. All stand about the y axis, their middle at the origin.
#include <cmath>

#include "scene/import/bodies/gltf_bodies.hpp"
#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr int kSides = 24;        // of what is round
constexpr int kCapRings = 5;      // of half a sphere, without its pole
constexpr double kLongest = 1e6;  // of a length in the file

double length(const Json& shape, const char* key, double otherwise) {
  const auto found = shape.find(key);
  if (found == shape.end()) return otherwise;
  return found->is_number() ? found->get<double>() : -1;
}

bool isLength(double value, bool mayBeZero = false) {
  return value < kLongest && (value > 0 || (mayBeZero && value == 0));
}

/// A circle of the surface: its height and radius.
struct Ring {
  double height, radius;
};

/// A closed surface of rings from below to above, and of a point below and one above them.
Mesh turned(const std::vector<Ring>& rings, double bottom, double top) {
  Mesh mesh;
  const auto add = [&](double x, double y, double z) {
    mesh.positions.push_back(Vec3(x, y, z).cast<float>());
  };
  add(0, bottom, 0);
  for (const Ring& ring : rings) {
    for (int side = 0; side < kSides; ++side) {
      const Vec3 way = headingFromDegrees(side * 360.0 / kSides);
      add(ring.radius * way.x(), ring.height, ring.radius * way.z());
    }
  }
  add(0, top, 0);
  const auto at = [](std::size_t ring, int side) {
    return static_cast<std::uint32_t>(1 + ring * kSides + static_cast<std::size_t>(side % kSides));
  };
  const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  };
  const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (int side = 0; side < kSides; ++side) {
    face(0, at(0, side + 1), at(0, side));
    for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
      face(at(ring, side), at(ring, side + 1), at(ring + 1, side + 1));
      face(at(ring, side), at(ring + 1, side + 1), at(ring + 1, side));
    }
    face(at(rings.size() - 1, side), at(rings.size() - 1, side + 1), last);
  }
  return mesh;
}

/// Two half spheres, `height` between their middles. Of different radii they are a capsule as well
/// as its hull is one.
Mesh capsule(double height, double below, double above) {
  std::vector<Ring> rings;
  for (int i = kCapRings; i >= 0; --i) {  // cosine and sine of the angle above the horizon
    const Vec3 way = headingFromDegrees(90.0 * i / (kCapRings + 1));
    rings.push_back({-height / 2 + below * way.z(), below * way.x()});
  }
  for (int i = height > 0 || below != above ? 0 : 1; i <= kCapRings; ++i) {
    const Vec3 way = headingFromDegrees(90.0 * i / (kCapRings + 1));
    rings.push_back({height / 2 - above * way.z(), above * way.x()});
  }
  return turned(rings, -height / 2 - below, height / 2 + above);
}

std::optional<Mesh> box(const Json& shape) {
  Vec3 size = Vec3::Ones();
  if (const auto told = shape.find("size"); told != shape.end()) {
    if (!told->is_array() || told->size() != 3) return std::nullopt;
    for (int i = 0; i < 3; ++i) {
      const Json& number = (*told)[static_cast<std::size_t>(i)];
      if (!number.is_number() || !isLength(number.get<double>())) return std::nullopt;
      size[i] = number.get<double>();
    }
  }
  Mesh mesh;
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 sign((i & 1u) != 0 ? 0.5 : -0.5, (i & 2u) != 0 ? 0.5 : -0.5,
                    (i & 4u) != 0 ? 0.5 : -0.5);
    mesh.positions.push_back(sign.cwiseProduct(size).cast<float>());
  }
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return mesh;
}

std::optional<Mesh> standing(const Json& shape, bool rounded) {
  const double height = length(shape, "height", 0.5), below = length(shape, "radiusBottom", 0.25),
               above = length(shape, "radiusTop", 0.25);
  if (!isLength(height)) return std::nullopt;
  // A cone's tip would be a ring of one point.
  if (!isLength(below) || !isLength(above)) return std::nullopt;
  if (rounded) return capsule(height, below, above);
  return turned({{-height / 2, below}, {height / 2, above}}, -height / 2, height / 2);
}

}  // namespace

std::optional<Mesh> implicitShape(const Json& shape) {
  if (!shape.is_object() || !shape.contains("type") || !shape["type"].is_string())
    return std::nullopt;
  const std::string type = shape["type"];
  const auto found = shape.find(type);
  const Json numbers = found != shape.end() && found->is_object() ? *found : Json::object();
  if (type == "box") return box(numbers);
  if (type == "capsule" || type == "cylinder") return standing(numbers, type == "capsule");
  if (type != "sphere") return std::nullopt;
  const double radius = length(numbers, "radius", 0.5);
  return isLength(radius) ? std::optional(capsule(0, radius, radius)) : std::nullopt;
}

}  // namespace enfilade::scene
