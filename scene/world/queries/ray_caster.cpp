#include "scene/world/queries/ray_caster.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "collision/shapes/triangle_tree.hpp"
#include "collision/sine_cosine.hpp"
#include "scene/world/data/validation.hpp"
#include "scene/world/queries/scene_trees.hpp"

namespace enfilade::scene {
namespace {

using collision::Triangle;

// Relative error of Embree's float distance. If the double-precision distance differs by more, the
// ray meets the plane at a grazing angle, and Embree's distance is the better one.
constexpr double kFloatError = 1e-4;

// ---- what Embree holds --------------------------------------------------------------------------

/// A hull in Embree.
struct HullSurface {
  std::shared_ptr<const collision::Hull> hull;  ///< keeps the key of its map entry alive
  std::vector<Triangle> triangles;
  EmbreeScene tree;  ///< null without triangles
};

/// The hulls of all avatars under one tree.
struct AvatarHulls {
  struct Instance {
    EntityId entity = 0;
    const HullSurface* hull = nullptr;
    Eigen::Affine3d worldFromHull = Eigen::Affine3d::Identity();
  };
  std::vector<Instance> instances;  ///< by Embree's instance id
  EmbreeScene tree;
};

/// A hit triangle, world, and its entity.
struct Surface {
  EntityId entity = 0;
  Triangle corners;
};

/// Placed meshes or avatars, which one query of Embree searches.
struct RayTarget {
  const RayTree* meshes = nullptr;
  const AvatarHulls* avatars = nullptr;  ///< not null: instead of `meshes`
  bool transparent = false;

  RTCScene tree() const { return avatars ? avatars->tree.get() : meshes->embreeScene(); }
  bool mayContain(EntityId entity) const { return avatars || meshes->mayContain(entity); }
  EntityId findEntity(unsigned instance, unsigned geometry, unsigned primitive) const {
    return avatars ? avatars->instances[instance].entity
                   : meshes->findTriangle(instance, geometry, primitive).batch->entity;
  }
  Surface findSurface(const RTCHit& hit) const {
    if (!avatars) {
      const BatchTriangle found = meshes->findTriangle(hit.instID[0], hit.geomID, hit.primID);
      return {found.batch->entity, found.corners(Vec3::Zero())};
    }
    const AvatarHulls::Instance& instance = avatars->instances[hit.instID[0]];
    Surface surface{instance.entity, instance.hull->triangles[hit.primID]};
    for (Vec3& corner : surface.corners) corner = instance.worldFromHull * corner;
    return surface;
  }
};

HullSurface makeHullSurface(RTCDevice device, const std::shared_ptr<const collision::Hull>& hull) {
  HullSurface surface{hull, {}, nullptr};
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::uint32_t> corners;
  for (const Vec3& vertex : hull->vertices) positions.push_back(vertex.cast<float>());
  for (const auto& face : hull->faces) {  // as counter-clockwise fans
    for (std::size_t i = 2; i < face.size(); ++i) {
      corners.insert(corners.end(), {face[0], face[i - 1], face[i]});
      surface.triangles.push_back(
          {hull->vertices[face[0]], hull->vertices[face[i - 1]], hull->vertices[face[i]]});
    }
  }
  if (!corners.empty()) surface.tree = buildTriangleTree(device, positions, corners, false);
  return surface;
}

// ---- one ray ------------------------------------------------------------------------------------

/// Context of Embree's filter callback. Masked triangles have no filter: rays see all of them.
struct FilterContext : QueryContext<RTCIntersectContext> {
  EntityId ignoredEntity;
  const RayTarget* target;
};

void rejectIgnoredEntity(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = reinterpret_cast<const FilterContext*>(arguments->context);
  RTCHitN* hit = arguments->hit;
  const unsigned n = arguments->N;
  const EntityId entity = context->target->findEntity(
      RTCHitN_instID(hit, n, 0, 0), RTCHitN_geomID(hit, n, 0), RTCHitN_primID(hit, n, 0));
  if (entity == context->ignoredEntity) arguments->valid[0] = 0;
}

FilterContext makeFilterContext(const RayFilter& filter, const RayTarget& target) {
  FilterContext context{{{}, nullptr}, filter.ignoredEntity, &target};
  rtcInitIntersectContext(&context.embree);
  if (filter.ignoredEntity != 0 && target.mayContain(filter.ignoredEntity))
    context.embree.filter = rejectIgnoredEntity;
  return context;
}

/// Extends `maxDistance` by Embree's error, so that the double-precision test decides.
RTCRay makeEmbreeRay(const Ray& ray, const Vec3& unit, const Vec3& treeOrigin) {
  const Eigen::Vector3f origin = (ray.origin - treeOrigin).cast<float>();
  const Eigen::Vector3f direction = unit.cast<float>();
  RTCRay embree{};
  embree.org_x = origin.x(), embree.org_y = origin.y(), embree.org_z = origin.z();
  embree.dir_x = direction.x(), embree.dir_y = direction.y(), embree.dir_z = direction.z();
  embree.tfar = static_cast<float>(ray.maxDistance +
                                   kFloatError * (1 + std::min(ray.maxDistance, kMaxCoordinate)));
  embree.mask = 0xFFFF'FFFFu;
  return embree;
}

/// Intersects the line with the triangle's plane, close to Embree's distance.
RayHit computeHit(const Surface& surface, const Ray& ray, const Vec3& unit, double embreeDistance) {
  const Triangle& t = surface.corners;
  Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double normalProjection = normal.dot(unit);
  const double inPlane =
      normal.dot(t[0] - ray.origin) / normalProjection;  // infinite or NaN if parallel
  const bool sharp = std::abs(inPlane - embreeDistance) <= kFloatError * (1 + embreeDistance);
  RayHit hit;
  hit.entity = surface.entity;
  hit.distance = std::max(0.0, sharp ? inPlane : embreeDistance);
  hit.point = ray.origin + hit.distance * unit;
  const double length = normal.norm();
  if (length > 0) hit.normal = (normalProjection > 0 ? -1 : 1) / length * normal;
  return hit;
}

std::optional<std::string> validatePosition(const char* field, const Vec3& value) {
  if (value.allFinite() && value.cwiseAbs().maxCoeff() <= kMaxCoordinate) return std::nullopt;
  return std::string(field) + ": its coordinates must be finite and within 1e7 m of the origin";
}

std::optional<std::string> validateDirection(const char* field, const Vec3& value) {
  const double length = value.norm();
  if (length > 1e-150 && length < 1e150) return std::nullopt;
  return std::string(field) + ": must be finite and longer than 0";
}

std::optional<std::string> validateMaxDistance(double maxDistance) {
  if (maxDistance > 0) return std::nullopt;
  return "reach: must be above 0 metres";
}

}  // namespace

// ---- the caster ---------------------------------------------------------------------------------

struct RayCaster::State {
  std::shared_ptr<const Scene> scene;
  SceneTrees& trees;                                    ///< of the scene
  std::map<const collision::Hull*, HullSurface> hulls;  ///< of the avatars present now
  AvatarHulls avatars;
  std::shared_ptr<PlacedItems> bodies;  ///< null before update(), or if there are none
  std::vector<RayTarget> targets;       ///< static meshes, bodies, avatars

  explicit State(std::shared_ptr<const Scene> shared)
      : scene(std::move(shared)), trees(SceneTrees::of(*scene)) {}
  void placeAvatars(const std::vector<AvatarSnapshot>& snapshots);
  void collectTargets();
  const HullSurface& getHullSurface(const std::shared_ptr<const collision::Hull>& hull);
  /// Calls `visit(target, context)` for all that a ray may hit, until it returns true.
  template <class Visit>
  bool visitTargets(const RayFilter& filter, const Visit& visit) const;
};

void RayCaster::State::collectTargets() {
  targets.clear();
  for (PlacedItems* placed : {trees.staticItems().get(), bodies.get()}) {
    if (!placed) continue;
    for (const bool transparent : {false, true})
      if (const RayTree* tree = trees.findOrBuildTree(*placed, transparent))
        targets.push_back({tree, nullptr, transparent});
  }
  if (!avatars.instances.empty()) targets.push_back({nullptr, &avatars});
}

void RayCaster::State::placeAvatars(const std::vector<AvatarSnapshot>& snapshots) {
  avatars = {{}, makeEmbreeScene(trees.device())};
  std::erase_if(hulls, [](const auto& entry) { return entry.second.hull.use_count() == 1; });
  for (const AvatarSnapshot& avatar : snapshots) {
    for (const AvatarPart& part : avatar.shape->parts) {
      const HullSurface& hull = getHullSurface(part.hull);
      if (!hull.tree) continue;
      Eigen::Affine3d worldFromHull = Eigen::Affine3d(Eigen::Translation3d(avatar.footPosition));
      worldFromHull.translate(part.offset).rotate(part.rotation);
      addInstance(trees.device(), avatars.tree.get(),
                  static_cast<unsigned>(avatars.instances.size()), hull.tree.get(),
                  Eigen::Translation3d(-trees.origin()) * worldFromHull);
      avatars.instances.push_back({avatar.id, &hull, worldFromHull});
    }
  }
  commitScene(trees.device(), avatars.tree.get());
}

const HullSurface& RayCaster::State::getHullSurface(
    const std::shared_ptr<const collision::Hull>& hull) {
  auto found = hulls.find(hull.get());
  if (found == hulls.end())
    found = hulls.emplace(hull.get(), makeHullSurface(trees.device(), hull)).first;
  return found->second;
}

RayCaster::RayCaster(std::shared_ptr<const Scene> scene)
    : state_(std::make_unique<State>(std::move(scene))) {
  state_->collectTargets();
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

void RayCaster::update(const Snapshot& snapshot) {
  state_->targets.clear();  // until all are placed
  state_->bodies = state_->trees.placeBodies(snapshot);
  state_->placeAvatars(snapshot.avatars);
  state_->collectTargets();
}

template <class Visit>
bool RayCaster::State::visitTargets(const RayFilter& filter, const Visit& visit) const {
  return std::ranges::any_of(targets, [&](const RayTarget& target) {
    if (target.transparent && filter.ignoreTransparent) return false;
    FilterContext context = makeFilterContext(filter, target);
    return visit(target, context.embree);
  });
}

std::optional<RayHit> RayCaster::firstHit(const Ray& ray, const RayFilter& filter) const {
  const Vec3 unit = ray.direction.normalized();
  RTCRayHit query{makeEmbreeRay(ray, unit, state_->trees.origin()), {}};
  const RayTarget* hitTarget = nullptr;
  RTCHit nearest{};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  state_->visitTargets(filter, [&](const RayTarget& target, RTCIntersectContext& context) {
    rtcIntersect1(target.tree(), &context, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return false;
    hitTarget = &target;
    nearest = query.hit;
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;  // the next must be nearer
    return false;
  });
  if (!hitTarget) return std::nullopt;
  const RayHit hit =
      computeHit(hitTarget->findSurface(nearest), ray, unit, static_cast<double>(query.ray.tfar));
  if (!(hit.distance <= ray.maxDistance)) return std::nullopt;
  return hit;
}

bool RayCaster::isBlocked(const Ray& ray, const RayFilter& filter) const {
  RTCRay query = makeEmbreeRay(ray, ray.direction.normalized(), state_->trees.origin());
  // Ends just before the target: a target does not occlude itself.
  query.tfar = static_cast<float>(ray.maxDistance * (1 - 1e-6));
  return state_->visitTargets(filter, [&](const RayTarget& target, RTCIntersectContext& context) {
    rtcOccluded1(target.tree(), &context, &query);
    return query.tfar < 0;  // Embree's encoding of a hit
  });
}

// ---- scans --------------------------------------------------------------------------------------

std::optional<std::string> validateRay(const Ray& ray) {
  if (auto error = validatePosition("origin", ray.origin)) return error;
  if (auto error = validateDirection("direction", ray.direction)) return error;
  return validateMaxDistance(ray.maxDistance);
}

std::optional<std::string> validateScan(const RangeScan& scan) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (auto error = validatePosition("at", scan.origin)) return error;
  if (auto error = validateDirection("forward", scan.forward)) return error;
  if (auto error = validateDirection("up", scan.up)) return error;
  const double sine = scan.forward.normalized().cross(scan.up.normalized()).norm();
  if (!(sine > 1e-6)) return "up: must not be parallel to forward";
  if (!(scan.width >= 0 && scan.width <= kTurn)) return "width: must lie in 0..2 pi radians";
  if (!(scan.height >= 0 && scan.height <= kTurn / 2)) return "height: must lie in 0..pi radians";
  if (scan.columns < 1) return "columns: must be at least 1";
  if (scan.rows < 1) return "rows: must be at least 1";
  return validateMaxDistance(scan.maxDistance);
}

std::vector<Ray> makeScanRays(const RangeScan& scan) {
  const Vec3 ahead = scan.forward.normalized();
  const Vec3 right = ahead.cross(scan.up).normalized();
  const Vec3 up = right.cross(ahead);
  const bool fullTurn = scan.width == 2 * std::numbers::pi;
  const auto step = [](double span, std::uint32_t count, bool open) {
    const std::uint32_t gaps = open ? count : count - 1;
    return gaps > 0 ? span / gaps : 0.0;
  };
  const double across = step(scan.width, scan.columns, fullTurn);
  const double down = step(scan.height, scan.rows, false);
  const double left = scan.columns > 1 ? -scan.width / 2 : 0,
               top = scan.rows > 1 ? scan.height / 2 : 0;
  const auto sineCosine = [](double radians) {
    return collision::computeSineCosineOfDegrees(radians * collision::kDegreesPerRadian);
  };
  std::vector<Vec3> levels;  // by column
  for (std::uint32_t column = 0; column < scan.columns; ++column) {
    const auto [sine, cosine] = sineCosine(left + column * across);
    levels.push_back(cosine * ahead + sine * right);
  }
  std::vector<Ray> rays;
  rays.reserve(std::size_t{scan.columns} * scan.rows);
  for (std::uint32_t row = 0; row < scan.rows; ++row) {
    const auto [sinePitch, cosinePitch] = sineCosine(top - row * down);
    for (const Vec3& level : levels)
      rays.push_back({scan.origin, cosinePitch * level + sinePitch * up, scan.maxDistance});
  }
  return rays;
}

}  // namespace enfilade::scene
