#include "scene/world/queries/ray_caster.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <map>
#include <numbers>
#include <stdexcept>
#include <string>

#include "collision/shapes/triangle_tree.hpp"

namespace enfilade::scene {
namespace {

using collision::Triangle;

constexpr double kFarthest = 1e7;  // metres, as for commands
constexpr unsigned kSolidBit = 1, kGlassBit = 2;
// What Embree's floats may be off, of its distance: beyond it the plane is met at a grazing angle,
// and Embree's own distance is the better one.
constexpr double kFloatError = 1e-4;

// ---- what Embree holds --------------------------------------------------------------------------

struct Release {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, Release>;
using EmbreeScene = std::unique_ptr<std::remove_pointer_t<RTCScene>, Release>;

/// The corners of a surface that is placed, in its own frame: a mesh of the model, or triangles of
/// a hull or of a mesh that is made flat.
struct Surface {
  const Mesh* mesh = nullptr;
  std::shared_ptr<const collision::Hull> hull;  ///< keeps what `triangles` was made of
  std::vector<Triangle> triangles;
  EmbreeScene embree;

  Triangle corners(std::uint32_t triangle, const Eigen::Affine3d& worldFromSurface) const {
    if (!mesh) {
      const Triangle& t = triangles[triangle];
      return {worldFromSurface * t[0], worldFromSurface * t[1], worldFromSurface * t[2]};
    }
    Triangle t;
    for (std::size_t i = 0; i < 3; ++i) {
      t[i] = worldFromSurface * mesh->positions[mesh->indices[3 * triangle + i]].cast<double>();
    }
    return t;
  }
};

/// One surface in its place: an instance of Embree, by whose number it is found.
struct Placed {
  EntityId entity = 0;
  const Surface* surface = nullptr;
  Eigen::Affine3d worldFromSurface = Eigen::Affine3d::Identity();
};

/// Many placed surfaces under one tree.
struct Placement {
  std::vector<Placed> placed;
  std::deque<Surface> flat;  ///< of `placed`: those that cannot be instanced, in the world's frame
  EmbreeScene embree;
};

EmbreeScene newScene(RTCDevice device) {
  EmbreeScene scene(rtcNewScene(device));
  rtcSetSceneFlags(scene.get(),
                   static_cast<RTCSceneFlags>(RTC_SCENE_FLAG_ROBUST | RTC_SCENE_FLAG_COMPACT |
                                              RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION));
  return scene;
}

void throwIfFailed(RTCDevice device) {
  switch (rtcGetDeviceError(device)) {
    case RTC_ERROR_NONE:
      return;
    case RTC_ERROR_OUT_OF_MEMORY:
      throw std::bad_alloc();
    default:
      throw std::runtime_error("rays: Embree could not build the scene");
  }
}

EmbreeScene sceneOf(RTCDevice device, std::span<const Eigen::Vector3f> positions,
                    std::span<const std::uint32_t> indices) {
  const RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  auto* vertices = static_cast<Eigen::Vector3f*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                              sizeof(Eigen::Vector3f), positions.size()));
  auto* corners = static_cast<std::uint32_t*>(
      rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                              3 * sizeof(std::uint32_t), indices.size() / 3));
  throwIfFailed(device);
  std::copy(positions.begin(), positions.end(), vertices);
  std::copy(indices.begin(), indices.begin() + static_cast<std::ptrdiff_t>(indices.size() / 3 * 3),
            corners);
  rtcCommitGeometry(geometry);
  EmbreeScene scene = newScene(device);
  rtcAttachGeometry(scene.get(), geometry);
  rtcReleaseGeometry(geometry);
  rtcCommitScene(scene.get());
  throwIfFailed(device);
  return scene;
}

std::vector<Triangle> trianglesOf(const Mesh& mesh, const Eigen::Affine3d& worldFromMesh) {
  std::vector<Triangle> triangles;
  const auto corner = [&](std::size_t i) {
    return Vec3(worldFromMesh * mesh.positions[mesh.indices[i]].cast<double>());
  };
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
    triangles.push_back({corner(i), corner(i + 1), corner(i + 2)});
  return triangles;
}

/// Counter-clockwise fans of the hull's faces.
std::vector<Triangle> trianglesOf(const collision::Hull& hull) {
  std::vector<Triangle> triangles;
  for (const auto& face : hull.faces) {
    for (std::size_t i = 2; i < face.size(); ++i) {
      triangles.push_back(
          {hull.vertices[face[0]], hull.vertices[face[i - 1]], hull.vertices[face[i]]});
    }
  }
  return triangles;
}

Surface surfaceOf(RTCDevice device, std::vector<Triangle> triangles) {
  Surface surface;
  surface.triangles = std::move(triangles);
  std::vector<Eigen::Vector3f> positions;
  std::vector<std::uint32_t> indices;
  for (const Triangle& triangle : surface.triangles) {
    for (const Vec3& corner : triangle) {
      indices.push_back(static_cast<std::uint32_t>(positions.size()));
      positions.push_back(corner.cast<float>());
    }
  }
  surface.embree = sceneOf(device, positions, indices);
  return surface;
}

void place(RTCDevice device, Placement& placement, const Placed& placed, unsigned mask) {
  const RTCGeometry instance = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(instance, placed.surface->embree.get());
  Eigen::Matrix<float, 3, 4, Eigen::RowMajor> transform =
      placed.worldFromSurface.matrix().topRows<3>().cast<float>();
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_ROW_MAJOR, transform.data());
  rtcSetGeometryMask(instance, mask);
  rtcCommitGeometry(instance);
  rtcAttachGeometryByID(placement.embree.get(), instance,
                        static_cast<unsigned>(placement.placed.size()));
  rtcReleaseGeometry(instance);
  placement.placed.push_back(placed);
}

// ---- one ray ------------------------------------------------------------------------------------

/// What Embree hands to the filter, its own part first.
struct Context {
  RTCIntersectContext embree;
  EntityId through;
  const Placement* placement;
};

void rejectThrough(const RTCFilterFunctionNArguments* arguments) {
  const auto* context = reinterpret_cast<const Context*>(arguments->context);
  const unsigned placed = RTCHitN_instID(arguments->hit, arguments->N, 0, 0);
  if (context->placement->placed[placed].entity == context->through) arguments->valid[0] = 0;
}

Context contextOf(const RayFilter& filter, const Placement& placement) {
  Context context{{}, filter.through, &placement};
  rtcInitIntersectContext(&context.embree);
  if (filter.through != 0) context.embree.filter = rejectThrough;
  return context;
}

/// `reach` a little beyond what doubles will be asked for.
RTCRay embreeRay(const Ray& ray, const Vec3& unit, double reach, const RayFilter& filter) {
  const Eigen::Vector3f from = ray.origin.cast<float>(), way = unit.cast<float>();
  RTCRay embree{};
  embree.org_x = from.x(), embree.org_y = from.y(), embree.org_z = from.z();
  embree.dir_x = way.x(), embree.dir_y = way.y(), embree.dir_z = way.z();
  embree.tfar = static_cast<float>(reach + kFloatError * (1 + std::min(reach, kFarthest)));
  embree.mask = filter.throughGlass ? kSolidBit : kSolidBit | kGlassBit;
  return embree;
}

/// Where the line meets the triangle's plane, near where Embree saw it.
RayHit meeting(const Placed& placed, std::uint32_t triangle, const Ray& ray, const Vec3& unit,
               double embreeDistance) {
  const Triangle t = placed.surface->corners(triangle, placed.worldFromSurface);
  Vec3 normal = (t[1] - t[0]).cross(t[2] - t[0]);
  const double along = normal.dot(unit);
  const double inPlane = normal.dot(t[0] - ray.origin) / along;  // not finite when along is 0
  const bool sharp = std::abs(inPlane - embreeDistance) <= kFloatError * (1 + embreeDistance);
  RayHit hit;
  hit.entity = placed.entity;
  hit.distance = std::max(0.0, sharp ? inPlane : embreeDistance);
  hit.point = ray.origin + hit.distance * unit;
  const double length = normal.norm();
  if (length > 0) hit.normal = (along > 0 ? -1 : 1) / length * normal;
  return hit;
}

std::optional<RayHit> firstOf(const Placement& placement, const Ray& ray, const Vec3& unit,
                              double reach, const RayFilter& filter) {
  if (placement.placed.empty()) return std::nullopt;
  Context context = contextOf(filter, placement);
  RTCRayHit query{embreeRay(ray, unit, reach, filter), {}};
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(placement.embree.get(), &context.embree, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  const RayHit hit = meeting(placement.placed[query.hit.instID[0]], query.hit.primID, ray, unit,
                             static_cast<double>(query.ray.tfar));
  if (!(hit.distance <= reach)) return std::nullopt;
  return hit;
}

bool anyOf(const Placement& placement, const Ray& ray, const Vec3& unit, const RayFilter& filter) {
  if (placement.placed.empty()) return false;
  Context context = contextOf(filter, placement);
  RTCRay query = embreeRay(ray, unit, ray.reach, filter);
  // Short of the end: what is looked at is not in its own way.
  query.tfar = static_cast<float>(ray.reach * (1 - 1e-6));
  rtcOccluded1(placement.embree.get(), &context.embree, &query);
  return query.tfar < 0;  // Embree's sign for yes
}

std::optional<std::string> badVector(const char* field, const Vec3& value) {
  if (value.allFinite() && value.cwiseAbs().maxCoeff() <= kFarthest) return std::nullopt;
  return std::string(field) + ": its coordinates must be finite and within 1e7 m of the origin";
}

std::optional<std::string> badDirection(const char* field, const Vec3& value) {
  const double length = value.norm();
  if (length > 1e-150 && length < 1e150) return std::nullopt;
  return std::string(field) + ": must be finite and longer than 0";
}

std::optional<std::string> badReach(double reach) {
  if (reach > 0) return std::nullopt;
  return "reach: must be above 0 metres";
}

}  // namespace

// ---- the caster ---------------------------------------------------------------------------------

struct RayCaster::State {
  std::shared_ptr<const Scene> scene;
  Device device{rtcNewDevice("threads=1,set_affinity=0")};
  std::vector<Surface> meshes;  ///< one a mesh of the model, without a tree where nothing uses it
  std::map<const collision::Hull*, Surface> hulls;  ///< of the avatars that are there now
  Placement still, bodies, avatars;
  std::shared_ptr<const std::vector<BodyView>> followed;  ///< where `bodies` has them

  /// Places an object's meshes; `worldFromAuthored` moves it from where it was authored.
  void placeObject(Placement& placement, std::uint32_t object, EntityId entity,
                   const Eigen::Affine3d& worldFromAuthored);
  /// Still objects that have an area, those that are only drawn among them; ascending.
  std::vector<std::uint32_t> stillDrawn() const;
  void placeStill();
  void placeBodies(const std::vector<BodyView>& views);
  void placeAvatars(const std::vector<AvatarView>& views);
  const Surface& surfaceOfMesh(std::uint32_t mesh);
  const Surface& surfaceOfHull(const std::shared_ptr<const collision::Hull>& hull);
  void commit(Placement& placement) const;
};

void RayCaster::State::commit(Placement& placement) const {
  rtcCommitScene(placement.embree.get());
  throwIfFailed(device.get());
}

const Surface& RayCaster::State::surfaceOfMesh(std::uint32_t mesh) {
  Surface& surface = meshes[mesh];
  if (!surface.mesh) {
    surface.mesh = &scene->model().meshes[mesh];
    surface.embree = sceneOf(device.get(), surface.mesh->positions, surface.mesh->indices);
  }
  return surface;
}

void RayCaster::State::placeObject(Placement& placement, std::uint32_t object, EntityId entity,
                                   const Eigen::Affine3d& worldFromAuthored) {
  const Model& model = scene->model();
  if (model.objects[object].use == Object::Use::solid) return;  // rays see what is drawn
  for (const std::uint32_t m : model.objects[object].meshes) {
    const Mesh& mesh = model.meshes[m];
    if (mesh.indices.size() < 3) continue;
    const bool glass = model.materials.size() > mesh.material &&
                       model.materials[mesh.material].alpha == Material::Alpha::blend;
    Placed placed{entity, nullptr, worldFromAuthored * model.objects[object].worldFromMesh};
    if (canBeInstanced(placed.worldFromSurface)) {
      placed.surface = &surfaceOfMesh(m);
    } else {
      placement.flat.push_back(surfaceOf(device.get(), trianglesOf(mesh, placed.worldFromSurface)));
      placed.surface = &placement.flat.back();
      placed.worldFromSurface.setIdentity();
    }
    place(device.get(), placement, placed, glass ? kGlassBit : kSolidBit);
  }
}

std::vector<std::uint32_t> RayCaster::State::stillDrawn() const {
  const Model& model = scene->model();
  std::vector<std::uint32_t> objects = scene->solidObjects();
  std::vector<bool> moves(model.objects.size());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) moves[object] = true;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    if (model.objects[i].use == Object::Use::drawn && !moves[i]) objects.push_back(i);
  std::sort(objects.begin(), objects.end());
  return objects;
}

void RayCaster::State::placeStill() {
  meshes.resize(scene->model().meshes.size());
  still.embree = newScene(device.get());
  for (const std::uint32_t object : stillDrawn())
    placeObject(still, object, object + 1, Eigen::Affine3d::Identity());
  commit(still);
}

void RayCaster::State::placeBodies(const std::vector<BodyView>& views) {
  bodies = {};
  bodies.embree = newScene(device.get());
  for (const BodyView& view : views) {
    const BodySpec& spec = scene->model().bodies[view.index];
    if (spec.kind == BodyKind::trigger) continue;
    Eigen::Affine3d worldFromAuthored = Eigen::Affine3d::Identity();
    if (view.displaced) {
      worldFromAuthored.translate(view.pose.translation)
          .rotate(view.pose.rotation)
          .translate(-scene->shapeOfBody(view.index)->origin);
    }
    for (const std::uint32_t object : spec.objects)
      placeObject(bodies, object, view.id, worldFromAuthored);
  }
  commit(bodies);
}

void RayCaster::State::placeAvatars(const std::vector<AvatarView>& views) {
  avatars = {};
  avatars.embree = newScene(device.get());
  std::erase_if(hulls, [](const auto& entry) { return entry.second.hull.use_count() == 1; });
  for (const AvatarView& avatar : views) {
    for (const AvatarPart& part : avatar.shape->parts) {
      const Surface& surface = surfaceOfHull(part.hull);
      if (surface.triangles.empty()) continue;
      Eigen::Affine3d worldFromHull = Eigen::Affine3d(Eigen::Translation3d(avatar.feet));
      worldFromHull.translate(part.offset).rotate(part.rotation);
      place(device.get(), avatars, {avatar.id, &surface, worldFromHull}, kSolidBit);
    }
  }
  commit(avatars);
}

const Surface& RayCaster::State::surfaceOfHull(const std::shared_ptr<const collision::Hull>& hull) {
  auto found = hulls.find(hull.get());
  if (found == hulls.end()) {
    found = hulls.emplace(hull.get(), surfaceOf(device.get(), trianglesOf(*hull))).first;
    found->second.hull = hull;
  }
  return found->second;
}

bool canBeInstanced(const Eigen::Affine3d& worldFromMesh) {
  const Eigen::Matrix3f linear = worldFromMesh.linear().cast<float>();
  const Eigen::Matrix3f inverse = linear.inverse();
  const Eigen::Vector3f origin = inverse * worldFromMesh.translation().cast<float>();
  return inverse.allFinite() && origin.allFinite();
}

RayCaster::RayCaster(std::shared_ptr<const Scene> scene) : state_(std::make_unique<State>()) {
  if (!state_->device) throw std::runtime_error("rays: Embree gives no device");
  state_->scene = std::move(scene);
  state_->placeStill();
}

RayCaster::~RayCaster() = default;
RayCaster::RayCaster(RayCaster&&) noexcept = default;
RayCaster& RayCaster::operator=(RayCaster&&) noexcept = default;

void RayCaster::follow(const Snapshot& snapshot) {
  if (snapshot.bodies != state_->followed) {
    state_->followed.reset();  // until they are all placed
    state_->placeBodies(*snapshot.bodies);
    state_->followed = snapshot.bodies;
  }
  state_->placeAvatars(snapshot.avatars);
}

std::optional<RayHit> RayCaster::firstHit(const Ray& ray, const RayFilter& filter) const {
  const Vec3 unit = ray.direction.normalized();
  std::optional<RayHit> nearest;
  for (const Placement* placement : {&state_->still, &state_->bodies, &state_->avatars}) {
    const double reach = nearest ? nearest->distance : ray.reach;
    if (const auto hit = firstOf(*placement, ray, unit, reach, filter)) nearest = hit;
  }
  return nearest;
}

bool RayCaster::isBlocked(const Ray& ray, const RayFilter& filter) const {
  const Vec3 unit = ray.direction.normalized();
  return anyOf(state_->avatars, ray, unit, filter) || anyOf(state_->bodies, ray, unit, filter) ||
         anyOf(state_->still, ray, unit, filter);
}

// ---- scans --------------------------------------------------------------------------------------

std::optional<std::string> refusal(const Ray& ray) {
  if (auto why = badVector("origin", ray.origin)) return why;
  if (auto why = badDirection("direction", ray.direction)) return why;
  return badReach(ray.reach);
}

std::optional<std::string> refusal(const RangeScan& scan) {
  constexpr double kTurn = 2 * std::numbers::pi;
  if (auto why = badVector("at", scan.at)) return why;
  if (auto why = badDirection("forward", scan.forward)) return why;
  if (auto why = badDirection("up", scan.up)) return why;
  const double aside = scan.forward.normalized().cross(scan.up.normalized()).norm();
  if (!(aside > 1e-6)) return "up: must not lie along forward";
  if (!(scan.width >= 0 && scan.width <= kTurn)) return "width: must lie in 0..2 pi radians";
  if (!(scan.height >= 0 && scan.height <= kTurn / 2)) return "height: must lie in 0..pi radians";
  if (scan.columns < 1) return "columns: must be at least 1";
  if (scan.rows < 1) return "rows: must be at least 1";
  return badReach(scan.reach);
}

std::vector<Ray> raysOf(const RangeScan& scan) {
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
      rays.push_back({scan.at, std::cos(pitch) * level + std::sin(pitch) * up, scan.reach});
    }
  }
  return rays;
}

}  // namespace enfilade::scene
