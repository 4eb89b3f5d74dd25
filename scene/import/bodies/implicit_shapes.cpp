#include "scene/import/bodies/implicit_shapes.hpp"

#include "scene/model/box_mesh.hpp"
#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr int kSideCount = 24;      // sides of a round shape
constexpr int kCapRingCount = 5;    // rings of a half sphere, without its pole
constexpr double kMaxLength = 1e6;  // metres

double readLength(const Json& shape, const char* key, double otherwise) {
  const auto found = shape.find(key);
  if (found == shape.end()) return otherwise;
  return found->is_number() ? found->get<double>() : -1;
}

bool isValidLength(double value, bool mayBeZero = false) {
  return value < kMaxLength && (value > 0 || (mayBeZero && value == 0));
}

/// A circle on the surface.
struct Ring {
  double height, radius;
};

/// Makes a closed surface of revolution from rings, bottom to top, and two poles.
Mesh makeRevolution(const std::vector<Ring>& rings, double bottom, double top) {
  Mesh mesh;
  const auto add = [&](double x, double y, double z) {
    mesh.positions.push_back(Vec3(x, y, z).cast<float>());
  };
  add(0, bottom, 0);
  for (const Ring& ring : rings) {
    for (int side = 0; side < kSideCount; ++side) {
      const Vec3 direction = makeHeadingFromDegrees(side * 360.0 / kSideCount);
      add(ring.radius * direction.x(), ring.height, ring.radius * direction.z());
    }
  }
  add(0, top, 0);
  const auto at = [](std::size_t ring, int side) {
    return static_cast<std::uint32_t>(1 + ring * kSideCount +
                                      static_cast<std::size_t>(side % kSideCount));
  };
  const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
    mesh.indices.insert(mesh.indices.end(), {a, b, c});
  };
  const auto last = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (int side = 0; side < kSideCount; ++side) {
    face(0, at(0, side + 1), at(0, side));
    for (std::size_t ring = 0; ring + 1 < rings.size(); ++ring) {
      face(at(ring, side), at(ring, side + 1), at(ring + 1, side + 1));
      face(at(ring, side), at(ring + 1, side + 1), at(ring + 1, side));
    }
    face(at(rings.size() - 1, side), at(rings.size() - 1, side + 1), last);
  }
  return mesh;
}

/// Makes a capsule with `height` between the centres of its half spheres. With different radii it
/// approximates the convex hull of both.
Mesh makeCapsule(double height, double below, double above) {
  std::vector<Ring> rings;
  for (int i = kCapRingCount; i >= 0; --i) {  // cosine and sine of the elevation
    const Vec3 direction = makeHeadingFromDegrees(90.0 * i / (kCapRingCount + 1));
    rings.push_back({-height / 2 + below * direction.z(), below * direction.x()});
  }
  for (int i = height > 0 || below != above ? 0 : 1; i <= kCapRingCount; ++i) {
    const Vec3 direction = makeHeadingFromDegrees(90.0 * i / (kCapRingCount + 1));
    rings.push_back({height / 2 - above * direction.z(), above * direction.x()});
  }
  return makeRevolution(rings, -height / 2 - below, height / 2 + above);
}

std::optional<Mesh> makeBox(const Json& shape) {
  Vec3 size = Vec3::Ones();
  if (const auto sizeValue = shape.find("size"); sizeValue != shape.end()) {
    if (!sizeValue->is_array() || sizeValue->size() != 3) return std::nullopt;
    for (int i = 0; i < 3; ++i) {
      const Json& number = (*sizeValue)[static_cast<std::size_t>(i)];
      if (!number.is_number() || !isValidLength(number.get<double>())) return std::nullopt;
      size[i] = number.get<double>();
    }
  }
  return makeBoxMesh({-0.5 * size, 0.5 * size});
}

std::optional<Mesh> makeUpright(const Json& shape, bool rounded) {
  const double height = readLength(shape, "height", 0.5),
               below = readLength(shape, "radiusBottom", 0.25),
               above = readLength(shape, "radiusTop", 0.25);
  if (!isValidLength(height)) return std::nullopt;
  // The tip of a cone would be a ring of radius 0.
  if (!isValidLength(below) || !isValidLength(above)) return std::nullopt;
  if (rounded) return makeCapsule(height, below, above);
  return makeRevolution({{-height / 2, below}, {height / 2, above}}, -height / 2, height / 2);
}

}  // namespace

std::optional<Mesh> makeImplicitShape(const Json& shape) {
  if (!shape.is_object() || !shape.contains("type") || !shape["type"].is_string())
    return std::nullopt;
  const std::string type = shape["type"];
  const auto found = shape.find(type);
  const Json numbers = found != shape.end() && found->is_object() ? *found : Json::object();
  if (type == "box") return makeBox(numbers);
  if (type == "capsule" || type == "cylinder") return makeUpright(numbers, type == "capsule");
  if (type != "sphere") return std::nullopt;
  const double radius = readLength(numbers, "radius", 0.5);
  return isValidLength(radius) ? std::optional(makeCapsule(0, radius, radius)) : std::nullopt;
}

}  // namespace enfilade::scene
