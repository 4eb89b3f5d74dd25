#include "scene/world/queries/ray_caster.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "collision/shapes/triangle_tree.hpp"
#include "scene/world/queries/embree.hpp"

namespace enfilade::scene {
namespace {

using collision::Triangle;

constexpr double kMaxCoordinate = 1e7;  // metres, as for commands
constexpr unsigned kOpaqueMask = 1, kTransparentMask = 2;
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

/// A placed mesh or hull: one Embree instance. Its index in the group is Embree's instance id.
struct SurfaceInstance {
  EntityId entity = 0;
  const Mesh* mesh = nullptr;
  const HullSurface* hull = nullptr;  ///< not null: instead of `mesh`
  Eigen::Affine3d worldFromSurface = Eigen::Affine3d::Identity();

  Triangle corners(std::uint32_t triangle) const {
    Triangle t;
    for (std::size_t i = 0; i < 3; ++i) {
      t[i] =
          hull ? worldFromSurface * hull->triangles[triangle][i]
               : worldFromSurface * mesh->positions[mesh->indices[3 * triangle + i]].cast<double>();
    }
    return t;
  }
};

/// Many surface instances under one tree.
struct InstanceGroup {
  std::vector<SurfaceInstance> instances;
  EmbreeScene embree;
};

constexpr EmbreeSceneOptions kSceneOptions{.robust = true, .compact = true};

/// The tree of a mesh that cannot be instanced, in scene frame.
EmbreeScene buildFlattenedTree(RTCDevice device, const Mesh& mesh,
                               const Eigen::Affine3d& worldFromMesh) {
  std::vector<Eigen::Vector3f> positions;
  positions.reserve(mesh.positions.size());
  for (const Eigen::Vector3f& position : mesh.positions)
    positions.push_back((worldFromMesh * position.cast<double>()).cast<float>());
  return buildTriangleTree(device, kSceneOptions, positions, mesh.indices);
}

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
  if (!corners.empty()) surface.tree = buildTriangleTree(device, kSceneOptions, positions, corners);
  return surface;
}

// ---- one ray ------------------------------------------------------------------------------------

/// Context of Embree's filter callback. Embree's own part must come first.
struct FilterContext {
  RTCIntersectContext embree;
  EntityId ignoredEntity;
  const InstanceGroup* group;
};

void rejectIgnoredEntity(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = reinterpret_cast<const FilterContext*>(arguments->context);
  const unsigned instance = RTCHitN_instID(arguments->hit, arguments->N, 0, 0);
  if (context->group->instances[instance].entity == context->ignoredEntity) arguments->valid[0] = 0;
}

FilterContext makeFilterContext(const RayFilter& filter, const InstanceGroup& group) {
  FilterContext context{{}, filter.ignoredEntity, &group};
  rtcInitIntersectContext(&context.embree);
  if (filter.ignoredEntity != 0) context.embree.filter = rejectIgnoredEntity;
  return context;
}

/// Extends `maxDistance` by Embree's error, so that the double-precision test decides.
RTCRay makeEmbreeRay(const Ray& ray, const Vec3& unit, double maxDistance,
                     const RayFilter& filter) {
  const Eigen::Vector3f origin = ray.origin.cast<float>(), direction = unit.cast<float>();
  RTCRay embree{};
  embree.org_x = origin.x(), embree.org_y = origin.y(), embree.org_z = origin.z();
  embree.dir_x = direction.x(), embree.dir_y = direction.y(), embree.dir_z = direction.z();
  embree.tfar =
      static_cast<float>(maxDistance + kFloatError * (1 + std::min(maxDistance, kMaxCoordinate)));
  embree.mask = filter.ignoreTransparent ? kOpaqueMask : kOpaqueMask | kTransparentMask;
  return embree;
}

/// Intersects the line with the triangle's plane, close to Embree's distance.
RayHit computeHit(const SurfaceInstance& instance, std::uint32_t triangle, const Ray& ray,
                  const Vec3& unit, double embreeDistance) {
  const Triangle t = instance.corners(triangle);
  Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double normalProjection = normal.dot(unit);
  const double inPlane =
      normal.dot(t[0] - ray.origin) / normalProjection;  // infinite or NaN if parallel
  const bool sharp = std::abs(inPlane - embreeDistance) <= kFloatError * (1 + embreeDistance);
  RayHit hit;
  hit.entity = instance.entity;
  hit.distance = std::max(0.0, sharp ? inPlane : embreeDistance);
  hit.point = ray.origin + hit.distance * unit;
  const double length = normal.norm();
  if (length > 0) hit.normal = (normalProjection > 0 ? -1 : 1) / length * normal;
  return hit;
}

std::optional<RayHit> findFirstHitIn(const InstanceGroup& group, const Ray& ray, const Vec3& unit,
                                     double maxDistance, const RayFilter& filter) {
  if (group.instances.empty()) return std::nullopt;
  FilterContext context = makeFilterContext(filter, group);
  RTCRayHit query{makeEmbreeRay(ray, unit, maxDistance, filter), {}};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(group.embree.get(), &context.embree, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const RayHit hit = computeHit(group.instances[query.hit.instID[0]], query.hit.primID, ray, unit,
                                static_cast<double>(query.ray.tfar));
  if (!(hit.distance <= maxDistance)) return std::nullopt;
  return hit;
}

bool isOccludedBy(const InstanceGroup& group, const Ray& ray, const Vec3& unit,
                  const RayFilter& filter) {
  if (group.instances.empty()) return false;
  FilterContext context = makeFilterContext(filter, group);
  RTCRay query = makeEmbreeRay(ray, unit, ray.maxDistance, filter);
  // Ends just before the target: a target does not occlude itself.
  query.tfar = static_cast<float>(ray.maxDistance * (1 - 1e-6));
  rtcOccluded1(group.embree.get(), &context.embree, &query);
  return query.tfar < 0;  // Embree's encoding of a hit
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
  MeshTrees meshes{kSceneOptions};
  std::map<const collision::Hull*, HullSurface> hulls;  ///< of the avatars present now
  InstanceGroup staticGroup, bodyGroup, avatarGroup;
  std::shared_ptr<const std::vector<BodySnapshot>>
      placedBodies;  ///< of which `bodyGroup` was built

  InstanceGroup makeGroup() const { return {{}, makeEmbreeScene(meshes.device(), kSceneOptions)}; }
  /// `worldFromTree` is the instance's worldFromSurface, except for a tree in scene frame.
  void addSurface(InstanceGroup& group, const SurfaceInstance& instance, RTCScene tree,
                  const Eigen::Affine3d& worldFromTree, unsigned mask);
  /// Adds instances of an object's meshes; `worldFromAuthored` moves it from its authored pose.
  void placeObject(InstanceGroup& group, std::uint32_t object, EntityId entity,
                   const Eigen::Affine3d& worldFromAuthored);
  /// Static objects with an area, and those that are only drawn; ascending.
  std::vector<std::uint32_t> findStaticVisualObjects() const;
  void placeStaticObjects();
  void placeBodies(const std::vector<BodySnapshot>& snapshots);
  void placeAvatars(const std::vector<AvatarSnapshot>& snapshots);
  const HullSurface& getHullSurface(const std::shared_ptr<const collision::Hull>& hull);
};

void RayCaster::State::addSurface(InstanceGroup& group, const SurfaceInstance& instance,
                                  RTCScene tree, const Eigen::Affine3d& worldFromTree,
                                  unsigned mask) {
  addInstance(meshes.device(), group.embree.get(), static_cast<unsigned>(group.instances.size()),
              tree, worldFromTree, mask);
  group.instances.push_back(instance);
}

void RayCaster::State::placeObject(InstanceGroup& group, std::uint32_t object, EntityId entity,
                                   const Eigen::Affine3d& worldFromAuthored) {
  const Model& model = scene->model();
  if (model.objects[object].usage == Object::Usage::collisionOnly)
    return;  // rays see drawn geometry
  for (const std::uint32_t m : model.objects[object].meshes) {
    const Mesh& mesh = model.meshes[m];
    if (mesh.indices.size() < 3) continue;
    const bool transparent = model.materials.size() > mesh.material &&
                             model.materials[mesh.material].alpha == Material::Alpha::blend;
    const unsigned mask = transparent ? kTransparentMask : kOpaqueMask;
    const SurfaceInstance instance{entity, &mesh, nullptr,
                                   worldFromAuthored * model.objects[object].worldFromMesh};
    if (canBeInstanced(instance.worldFromSurface)) {
      addSurface(group, instance, meshes.findOrBuild(mesh), instance.worldFromSurface, mask);
    } else {
      const auto tree = buildFlattenedTree(meshes.device(), mesh, instance.worldFromSurface);
      addSurface(group, instance, tree.get(), Eigen::Affine3d::Identity(), mask);
    }
  }
}

std::vector<std::uint32_t> RayCaster::State::findStaticVisualObjects() const {
  const Model& model = scene->model();
  std::vector<std::uint32_t> objects = scene->solidObjects();
  std::vector<bool> moves(model.objects.size());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) moves[object] = true;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    if (model.objects[i].usage == Object::Usage::visualOnly && !moves[i]) objects.push_back(i);
  std::sort(objects.begin(), objects.end());
  return objects;
}

void RayCaster::State::placeStaticObjects() {
  staticGroup = makeGroup();
  for (const std::uint32_t object : findStaticVisualObjects())
    placeObject(staticGroup, object, object + 1, Eigen::Affine3d::Identity());
  commitScene(meshes.device(), staticGroup.embree.get());
}

void RayCaster::State::placeBodies(const std::vector<BodySnapshot>& snapshots) {
  bodyGroup = makeGroup();
  for (const BodySnapshot& body : snapshots) {
    const BodySpec& spec = scene->model().bodies[body.index];
    if (isTrigger(spec.kind)) continue;
    Eigen::Affine3d worldFromAuthored = Eigen::Affine3d::Identity();
    if (body.displaced)
      worldFromAuthored = computeWorldFromAuthored(*scene->bodyShape(body.index), body.pose);
    for (const std::uint32_t object : spec.objects)
      placeObject(bodyGroup, object, body.id, worldFromAuthored);
  }
  commitScene(meshes.device(), bodyGroup.embree.get());
}

void RayCaster::State::placeAvatars(const std::vector<AvatarSnapshot>& snapshots) {
  avatarGroup = makeGroup();
  std::erase_if(hulls, [](const auto& entry) { return entry.second.hull.use_count() == 1; });
  for (const AvatarSnapshot& avatar : snapshots) {
    for (const AvatarPart& part : avatar.shape->parts) {
      const HullSurface& hull = getHullSurface(part.hull);
      if (!hull.tree) continue;
      Eigen::Affine3d worldFromHull = Eigen::Affine3d(Eigen::Translation3d(avatar.footPosition));
      worldFromHull.translate(part.offset).rotate(part.rotation);
      addSurface(avatarGroup, {avatar.id, nullptr, &hull, worldFromHull}, hull.tree.get(),
                 worldFromHull, kOpaqueMask);
    }
  }
  commitScene(meshes.device(), avatarGroup.embree.get());
}

const HullSurface& RayCaster::State::getHullSurface(
    const std::shared_ptr<const collision::Hull>& hull) {
  auto found = hulls.find(hull.get());
  if (found == hulls.end())
    found = hulls.emplace(hull.get(), makeHullSurface(meshes.device(), hull)).first;
  return found->second;
}

RayCaster::RayCaster(std::shared_ptr<const Scene> scene) : state_(std::make_unique<State>()) {
  state_->scene = std::move(scene);
  state_->placeStaticObjects();
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

void RayCaster::update(const Snapshot& snapshot) {
  if (snapshot.bodies != state_->placedBodies) {
    state_->placedBodies.reset();  // until all bodies are placed
    state_->placeBodies(*snapshot.bodies);
    state_->placedBodies = snapshot.bodies;
  }
  state_->placeAvatars(snapshot.avatars);
}

std::optional<RayHit> RayCaster::firstHit(const Ray& ray, const RayFilter& filter) const {
  const Vec3 unit = ray.direction.normalized();
  std::optional<RayHit> nearest;
  for (const InstanceGroup* group :
       {&state_->staticGroup, &state_->bodyGroup, &state_->avatarGroup}) {
    const double maxDistance = nearest ? nearest->distance : ray.maxDistance;
    if (const auto hit = findFirstHitIn(*group, ray, unit, maxDistance, filter)) nearest = hit;
  }
  return nearest;
}

bool RayCaster::isBlocked(const Ray& ray, const RayFilter& filter) const {
  const Vec3 unit = ray.direction.normalized();
  return isOccludedBy(state_->avatarGroup, ray, unit, filter) ||
         isOccludedBy(state_->bodyGroup, ray, unit, filter) ||
         isOccludedBy(state_->staticGroup, ray, unit, filter);
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
  std::vector<Ray> rays;
  rays.reserve(std::size_t{scan.columns} * scan.rows);
  for (std::uint32_t row = 0; row < scan.rows; ++row) {
    const double pitch = top - row * down;
    for (std::uint32_t column = 0; column < scan.columns; ++column) {
      const double yaw = left + column * across;
      const Vec3 level = std::cos(yaw) * ahead + std::sin(yaw) * right;
      rays.push_back(
          {scan.origin, std::cos(pitch) * level + std::sin(pitch) * up, scan.maxDistance});
    }
  }
  return rays;
}

}  // namespace enfilade::scene
