// Ray casts against all drawn objects, bodies and avatars: picking, line of sight, range scans.
// Embree finds the triangle (float, ROBUST mode); the hit point is computed in doubles. The order
// of two surfaces is therefore certain to about 1e-6 of the coordinates, the distance to 1e-15.
// Outside the tick only: Embree's bits depend on the processor's instruction set, so no state of a
// world may depend on a ray.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::scene {

struct Ray {
  Vec3 origin = Vec3::Zero();                                    ///< scene frame, metres
  Vec3 direction = Vec3::UnitX();                                ///< any length above zero
  double maxDistance = std::numeric_limits<double>::infinity();  ///< metres, > 0
};

struct RayHit {
  EntityId entity = 0;
  double distance = 0;          ///< metres from the origin
  Vec3 point = Vec3::Zero();    ///< scene frame, metres
  Vec3 normal = Vec3::UnitY();  ///< unit, of the triangle, facing the ray's origin
};

/// Geometry that a ray ignores.
struct RayFilter {
  EntityId ignoredEntity = 0;      ///< such as the avatar that looks; 0: none
  bool ignoreTransparent = false;  ///< half-transparent surfaces (Material::Alpha::blend)
};

/// Rays over a rectangle of angles, as cast by a range scanner.
struct RangeScan {
  Vec3 origin = Vec3::Zero();    ///< scene frame, metres
  Vec3 forward = Vec3::UnitX();  ///< centre of the scan; any length above zero
  Vec3 up = Vec3::UnitY();       ///< not parallel to forward
  double width = 0;              ///< radians, 0..2 pi, about `up`, from left to right
  double height = 0;             ///< radians, 0..pi, from top to bottom; 0: one plane
  std::uint32_t columns = 1;     ///< rays per row; a full turn does not repeat its first ray
  std::uint32_t rows = 1;        ///< number of rows
  double maxDistance = std::numeric_limits<double>::infinity();  ///< metres, > 0
};

/// Return an error text that starts with the field's name; nullopt if valid.
std::optional<std::string> validateRay(const Ray& ray);
std::optional<std::string> validateScan(const RangeScan& scan);

/// Row by row from the top, each from left to right. Angles are measured about the component of
/// `up` perpendicular to `forward`, and from the plane perpendicular to that, so a row is a cone.
/// Directions have unit length.
std::vector<Ray> makeScanRays(const RangeScan& scan);

/// Ray queries on a scene. The constructor builds the trees of static objects, update() those of
/// bodies, unless the scene has them already (SceneTrees), and of avatars. One thread at a time may
/// call update(); between calls any number may cast rays.
class RayCaster {
 public:
  explicit RayCaster(std::shared_ptr<const Scene> scene);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// Updates avatars and bodies from `snapshot`: bodies as they are drawn, under the id of their
  /// first object, without triggers. Before the first call there are none.
  void update(const Snapshot& snapshot);

  /// First hit of a ray that validateRay() accepts.
  std::optional<RayHit> firstHit(const Ray& ray, const RayFilter& filter = {}) const;
  /// True if anything is hit within maxDistance; faster than firstHit().
  bool isBlocked(const Ray& ray, const RayFilter& filter = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::scene
