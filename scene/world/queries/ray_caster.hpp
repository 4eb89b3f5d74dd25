// Rays against everything that can be touched: picking, line of sight, range scans. Embree finds
// the triangle (float, ROBUST mode); where the ray meets it is worked out in doubles. Which of two
// surfaces comes first is so decided to some 1e-6 of the coordinates, how far it is to 1e-15.
//
// Outside the tick: Embree's bits depend on the processor's instruction set, so nothing that a
// world does may follow from a ray.
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
  Vec3 origin = Vec3::Zero();                              ///< scene frame, metres
  Vec3 direction = Vec3::UnitX();                          ///< any length but zero
  double reach = std::numeric_limits<double>::infinity();  ///< metres, > 0
};

struct RayHit {
  EntityId entity = 0;
  double distance = 0;          ///< metres from the origin
  Vec3 point = Vec3::Zero();    ///< scene frame, metres
  Vec3 normal = Vec3::UnitY();  ///< unit, of the triangle, towards the side the ray comes from
};

/// What a ray passes.
struct RayFilter {
  EntityId through = 0;       ///< this entity, as the avatar that looks; 0: none
  bool throughGlass = false;  ///< what is drawn half-transparent (Material::Alpha::blend)
};

/// Rays over a rectangle of angles, as a range scanner casts them.
struct RangeScan {
  Vec3 at = Vec3::Zero();        ///< scene frame, metres
  Vec3 forward = Vec3::UnitX();  ///< the middle of the scan; any length but zero
  Vec3 up = Vec3::UnitY();       ///< not along forward
  double width = 0;              ///< radians, 0..2 pi, about `up`, from left to right
  double height = 0;             ///< radians, 0..pi, from above to below; 0: one plane
  std::uint32_t columns = 1;     ///< rays side by side; a full turn does not repeat its first
  std::uint32_t rows = 1;        ///< rays above one another
  double reach = std::numeric_limits<double>::infinity();  ///< metres, > 0
};

/// Why rays or a scan cannot be cast, naming the field; nullopt when they can.
std::optional<std::string> refusal(const Ray& ray);
std::optional<std::string> refusal(const RangeScan& scan);

/// Row by row from above, each from left to right. Angles are measured about what of `up` is square
/// to `forward`, and from the plane square to that, so a row is a cone; directions have unit
/// length.
std::vector<Ray> raysOf(const RangeScan& scan);

/// The still scene, built at construction (meshes stored once), and what moves, as of a snapshot.
/// One thread at a time may follow(); any number may cast between.
/// Whether Embree can have an instance there. It inverts the transform in floats, and Debian's
/// build of it ends the program where that cannot be done, as for an object that a file makes flat.
bool canBeInstanced(const Eigen::Affine3d& worldFromMesh);

class RayCaster {
 public:
  explicit RayCaster(std::shared_ptr<const Scene> scene);
  ~RayCaster();
  RayCaster(RayCaster&&) noexcept;
  RayCaster& operator=(RayCaster&&) noexcept;

  /// Takes avatars and bodies where `snapshot` has them: bodies as they are drawn, under the id of
  /// their first object; triggers are not there. Before the first call there are none.
  void follow(const Snapshot& snapshot);

  /// What a ray that refusal() lets pass meets first.
  std::optional<RayHit> firstHit(const Ray& ray, const RayFilter& filter = {}) const;
  /// Whether anything is met within the reach; quicker than what is met first.
  bool isBlocked(const Ray& ray, const RayFilter& filter = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace enfilade::scene
