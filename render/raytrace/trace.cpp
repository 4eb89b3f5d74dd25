#include "render/raytrace/trace.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "collision/assert.hpp"

namespace enfilade::render {
namespace {

constexpr int kPacketSize = kTileSize * kTileSize;  // rays per packet
constexpr double kCoplanarGap = 2e-5;               // metres, between surfaces in one plane
constexpr double kMaxCoplanarSlack = 0.1;           // metres along a ray that grazes a surface
constexpr double kMinCoplanarCosine = 1 - 1e-6;     // of their normals

// A key: 3 bits of tree, 1 of geometry, 28 of instance (all ones: none), 32 of primitive.
constexpr HitKey kNoInstance = (HitKey{1} << 28) - 1;

HitKey makeHitKey(std::size_t tree, unsigned instance, unsigned geometry, unsigned primitive) {
  const bool placed = instance != RTC_INVALID_GEOMETRY_ID;
  ENFILADE_ASSERT(tree < 8 && (placed ? instance < kNoInstance : geometry < 2));
  const HitKey instanceBits = placed ? instance : kNoInstance;
  return HitKey{tree} << 61 | HitKey{placed ? 0u : geometry} << 60 | instanceBits << 32 | primitive;
}

/// Context that Embree passes to the filters.
struct FilterContext : scene::QueryContext<RTCIntersectContext> {
  const TraceContext* trace;
  std::size_t tree;             ///< index into trace->trees
  std::vector<PixelHit>* hits;  ///< collects all hits; null: only first hits are needed
  bool byBarycentrics = false;  ///< alpha at the hit itself: the ray has no pixel
};

/// Calls `visitLane(lane, instance, geometry, primitive)` for the active lanes of a filter call.
template <class VisitLane>
void forEachLane(const RTCFilterFunctionNArguments* arguments, const VisitLane& visitLane) {
  RTCHitN* hit = arguments->hit;
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] == 0) continue;
    visitLane(i, RTCHitN_instID(hit, n, i, 0), RTCHitN_geomID(hit, n, i),
              RTCHitN_primID(hit, n, i));
  }
}

const FilterContext& getFilterContext(const RTCFilterFunctionNArguments* arguments) {
  return *reinterpret_cast<const FilterContext*>(arguments->context);
}

void rejectTransparentTexels(const RTCFilterFunctionNArguments* arguments) {
  const FilterContext& context = getFilterContext(arguments);
  const TraceContext& trace = *context.trace;
  const RayTree& tree = *trace.trees[context.tree];
  forEachLane(arguments, [&](unsigned lane, unsigned instance, unsigned geometry,
                             unsigned primitive) {
    const BatchTriangle batchTriangle = tree.findTriangle(instance, geometry, primitive);
    if (context.byBarycentrics) {
      const unsigned n = arguments->N;
      const float alpha = trace.shading.sampleAlpha(
          batchTriangle, RTCHitN_u(arguments->hit, n, lane), RTCHitN_v(arguments->hit, n, lane));
      if (alpha < batchTriangle.batch->material->alphaCutoff) arguments->valid[lane] = 0;
      return;
    }
    const ShadedTriangle triangle(batchTriangle, trace.rays);
    const auto pixel = static_cast<int>(RTCRayN_id(arguments->ray, arguments->N, lane));
    const int x = pixel % trace.rays.width, y = pixel / trace.rays.width;
    const float alpha = trace.shading.computeAlbedo(triangle, x, y)[3];
    if (alpha < triangle.batch->material->alphaCutoff) arguments->valid[lane] = 0;
  });
}

FilterContext makeFilterContext(const TraceContext& trace, std::size_t tree) {
  FilterContext context{{{}, rejectTransparentTexels}, &trace, tree, nullptr};
  rtcInitIntersectContext(&context.embree);
  context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

void rejectIgnoredEntity(const RTCFilterFunctionNArguments* arguments) {
  const TraceContext& trace = *getFilterContext(arguments).trace;
  const RayTree& tree = *trace.trees[getFilterContext(arguments).tree];
  forEachLane(
      arguments, [&](unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
        if (tree.findTriangle(instance, geometry, primitive).batch->id == trace.ignoredEntity)
          arguments->valid[lane] = 0;
      });
}

/// Lets rays pass through the ignored entity. A filter costs at each hit, so only trees that may
/// contain the entity get one.
void setIgnoredEntity(FilterContext& context, const TraceContext& trace) {
  if (trace.trees[context.tree]->mayContain(trace.ignoredEntity))
    context.embree.filter = rejectIgnoredEntity;
}

void recordAllHits(const RTCFilterFunctionNArguments* arguments) {
  const FilterContext& context = getFilterContext(arguments);
  forEachLane(arguments,
              [&](unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
                context.hits->push_back({RTCRayN_id(arguments->ray, arguments->N, lane),
                                         makeHitKey(context.tree, instance, geometry, primitive)});
                arguments->valid[lane] = 0;
              });
}

/// One pixel's ray between two depths.
RTCRayHit makePixelRay(const TraceContext& trace, double x, double y, double from, double to) {
  const PrimaryRays& rays = trace.rays;
  const Eigen::Vector3f start = (rays.eye - trace.origin + rays.startAt(x, y)).cast<float>();
  const Eigen::Vector3f direction = rays.directionAt(x, y).cast<float>();
  RTCRayHit query{};
  query.ray.org_x = start.x(), query.ray.org_y = start.y(), query.ray.org_z = start.z();
  query.ray.dir_x = direction.x(), query.ray.dir_y = direction.y(), query.ray.dir_z = direction.z();
  query.ray.tnear = static_cast<float>(std::max(0.0, from - rays.start));
  query.ray.tfar = static_cast<float>(to - rays.start);
  query.ray.mask = 0xFFFF'FFFFu;
  query.ray.id = static_cast<unsigned>(static_cast<int>(y) * rays.width + static_cast<int>(x));
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

/// The primary rays of a tile; `valid` marks those in the image.
struct RayPacket {
  RTCRayHit16 query;
  alignas(64) int valid[kPacketSize];
};

void setUpPrimaryRays(RayPacket& packet, const TraceContext& trace, int x0, int y0) {
  const PrimaryRays& rays = trace.rays;
  const Eigen::Vector3f from = (rays.eye - trace.origin + rays.startAt(x0, y0)).cast<float>();
  const Eigen::Vector3f direction = rays.directionAt(x0, y0).cast<float>();
  const Eigen::Vector3f fromX = rays.originX.cast<float>(), fromY = rays.originY.cast<float>();
  const Eigen::Vector3f directionX = rays.directionX.cast<float>(),
                        directionY = rays.directionY.cast<float>();
  RTCRay16& ray = packet.query.ray;
  for (int lane = 0; lane < kPacketSize; ++lane) {
    const int column = lane % kTileSize, row = lane / kTileSize;
    const auto x = static_cast<float>(column), y = static_cast<float>(row);
    ray.org_x[lane] = from.x() + x * fromX.x() + y * fromY.x();
    ray.org_y[lane] = from.y() + x * fromX.y() + y * fromY.y();
    ray.org_z[lane] = from.z() + x * fromX.z() + y * fromY.z();
    ray.dir_x[lane] = direction.x() + x * directionX.x() + y * directionY.x();
    ray.dir_y[lane] = direction.y() + x * directionX.y() + y * directionY.y();
    ray.dir_z[lane] = direction.z() + x * directionX.z() + y * directionY.z();
    const bool inside = x0 + column < rays.width && y0 + row < rays.height;
    packet.valid[lane] = inside ? -1 : 0;
    // Embree 3.13 also traces invalid lanes of coherent packets. They get an empty interval.
    ray.tnear[lane] = inside ? static_cast<float>(rays.near - rays.start) : 1.0f;
    ray.tfar[lane] = inside ? static_cast<float>(rays.far - rays.start) : -1.0f;
    ray.time[lane] = 0;
    ray.mask[lane] = 0xFFFF'FFFFu;
    ray.flags[lane] = 0;
    ray.id[lane] = static_cast<unsigned>((y0 + row) * rays.width + x0 + column);
    packet.query.hit.geomID[lane] = RTC_INVALID_GEOMETRY_ID;
    packet.query.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
  }
}

void intersectPacket(RayPacket& packet, const TraceContext& trace, FilterContext& context) {
  rtcIntersect16(packet.valid, trace.trees[context.tree]->embreeScene(), &context.embree,
                 &packet.query);
}

/// Of opaque surfaces in the plane of a hit, that of the lowest rank at a point of the image.
/// Rounding decides which of them Embree finds.
HitKey chooseCoplanar(const TraceContext& trace, double x, double y, HitKey hit) {
  const BatchTriangle found = findTriangle(trace, hit);
  if (found.batch->coplanarRank() == 0) return hit;
  const PrimaryRays& rays = trace.rays;
  const EyeSpaceCorners corners = found.corners(rays.eye);
  const double z = computePlaneDepth(corners, rays).at(x, y);
  const Vec3 direction = rays.directionAt(x, y), point = rays.originAt(x, y) + z * direction;
  const Vec3 place = rays.eye + point;
  if (std::ranges::none_of(found.batch->coplanar->lower, [&](const scene::Aabb& box) {
        return collision::contains(box, {place, place});
      }))
    return hit;
  const Vec3 normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
  // Embree's coordinates are floats, relative to the origin of the trees.
  const double rounding = 1e-6 * (place - trace.origin).cwiseAbs().maxCoeff();
  const double slack =
      std::min((kCoplanarGap + rounding) / std::abs(normal.dot(direction)), kMaxCoplanarSlack);
  const double meshRounding = 1e-7 * place.cwiseAbs().maxCoeff();  // its positions are floats, too
  std::vector<HitKey> keys;
  traceBetween(trace, x, y, z - slack, z + slack, keys);
  std::uint8_t rank = found.batch->coplanarRank();
  for (const HitKey key : keys) {
    const BatchTriangle other = findTriangle(trace, key);
    if (other.batch->coplanarRank() >= rank) continue;
    if (other.batch->material->alpha != scene::Material::Alpha::opaque) continue;
    const std::array<Vec3, 3> c = other.corners(rays.eye);
    const Vec3 otherNormal = (c[1] - c[0]).cross(c[2] - c[0]).normalized();
    if (!(std::abs(otherNormal.dot(point - c[0])) <= kCoplanarGap + meshRounding)) continue;
    if (!(std::abs(otherNormal.dot(normal)) >= kMinCoplanarCosine)) continue;
    hit = key;
    rank = other.batch->coplanarRank();
  }
  return hit;
}

}  // namespace

BatchTriangle findTriangle(const TraceContext& trace, HitKey key) {
  ENFILADE_ASSERT(key != kNoHit && key >> 61 < trace.trees.size());
  const HitKey instanceBits = key >> 32 & kNoInstance;
  const unsigned instance =
      instanceBits == kNoInstance ? RTC_INVALID_GEOMETRY_ID : static_cast<unsigned>(instanceBits);
  return trace.trees[key >> 61]->findTriangle(instance, static_cast<unsigned>(key >> 60 & 1),
                                              static_cast<unsigned>(key & 0xFFFF'FFFFu));
}

void traceRows(const TraceContext& trace, int y, std::vector<HitKey>& keys) {
  const auto width = static_cast<std::size_t>(trace.rays.width);
  keys.assign(width * kTileSize, kNoHit);
  RayPacket packet;
  for (int x = 0; x < trace.rays.width; x += kTileSize) {
    setUpPrimaryRays(packet, trace, x, y);
    for (std::size_t t = 0; t < trace.trees.size(); ++t) {
      FilterContext context = makeFilterContext(trace, t);
      setIgnoredEntity(context, trace);
      intersectPacket(packet, trace, context);
      RTCHit16& hit = packet.query.hit;
      for (std::size_t lane = 0; lane < kPacketSize; ++lane) {
        if (hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
        const std::size_t column = static_cast<std::size_t>(x) + lane % kTileSize;
        keys[lane / kTileSize * width + column] =
            makeHitKey(t, hit.instID[0][lane], hit.geomID[lane], hit.primID[lane]);
        // The next tree overwrites this hit only if it is nearer.
        hit.geomID[lane] = hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
      }
    }
  }
  if (trace.isDepthOnly) return;
  HitKey kept = kNoHit;  // most neighbours have one triangle, of no coplanar surface
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (keys[i] == kept || keys[i] == kNoHit) continue;
    if (findTriangle(trace, keys[i]).batch->coplanarRank() == 0) {
      kept = keys[i];
      continue;
    }
    keys[i] = chooseCoplanar(trace, static_cast<double>(i % width),
                             y + static_cast<double>(i / width), keys[i]);
  }
}

void traceAllHits(const TraceContext& trace, int y, const std::vector<float>& depth,
                  std::vector<PixelHit>& hits) {
  RayPacket packet;
  for (int x = 0; x < trace.rays.width; x += kTileSize) {
    setUpPrimaryRays(packet, trace, x, y);
    for (std::size_t lane = 0; lane < kPacketSize; ++lane) {
      if (packet.valid[lane] == 0) continue;
      const double z = static_cast<double>(depth[packet.query.ray.id[lane]]) - trace.rays.start;
      // Margin for the float precision of Embree's distances.
      if (!std::isnan(z)) packet.query.ray.tfar[lane] = static_cast<float>(z * 1.0001 + 1e-4);
    }
    for (std::size_t t = 0; t < trace.trees.size(); ++t) {
      FilterContext context = makeFilterContext(trace, t);
      context.hits = &hits;
      context.embree.filter = recordAllHits;
      intersectPacket(packet, trace, context);
    }
  }
}

namespace {

/// Length of a shadow ray up to the clip planes of an orthographic camera; clipped geometry casts
/// no shadow. Infinite for other cameras.
double computeMaxSunDistance(const PrimaryRays& rays, double z, const Vec3& sun) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const double sunForward = sun.dot(rays.forward);
  if (!rays.parallel || sunForward == 0) return kEndless;
  return ((sunForward > 0 ? rays.far : rays.near) - z) / sunForward;
}

/// The shadow rays of a tile; `valid` marks the active ones.
struct ShadowPacket {
  RTCRay16 ray{};
  alignas(64) int valid[kPacketSize];
};

/// Sets up a lane's shadow ray from the visible surface towards the sun; NaN `z`: inactive. The ray
/// starts slightly towards the eye, where space is free, so that float rounding cannot place it
/// behind the surface. Its first millimetre is skipped to avoid grazing self-intersections.
void setUpShadowRay(ShadowPacket& packet, int lane, const TraceContext& trace, double x, double y,
                    double z, const Vec3& sun) {
  const PrimaryRays& rays = trace.rays;
  const bool active = !std::isnan(z);
  const double before = active ? z - 1e-4 * std::abs(z) : rays.start;
  const Vec3 start =
      rays.eye - trace.origin + rays.originAt(x, y) + before * rays.directionAt(x, y);
  RTCRay16& ray = packet.ray;
  ray.org_x[lane] = static_cast<float>(start.x());
  ray.org_y[lane] = static_cast<float>(start.y());
  ray.org_z[lane] = static_cast<float>(start.z());
  ray.dir_x[lane] = static_cast<float>(sun.x());
  ray.dir_y[lane] = static_cast<float>(sun.y());
  ray.dir_z[lane] = static_cast<float>(sun.z());
  ray.tnear[lane] = static_cast<float>(1e-3 + 2e-6 * start.cwiseAbs().maxCoeff());
  // Inactive lanes get an empty interval, as in setUpPrimaryRays().
  ray.tfar[lane] = active ? static_cast<float>(computeMaxSunDistance(rays, before, sun)) : -1.0f;
  ray.mask[lane] = 0xFFFF'FFFFu;
  ray.id[lane] = static_cast<unsigned>(static_cast<int>(y) * rays.width + static_cast<int>(x));
  packet.valid[lane] = active ? -1 : 0;
}

}  // namespace

void traceShadowRows(const TraceContext& trace, int y, const std::vector<float>& depth,
                     std::vector<std::uint8_t>& mask) {
  const PrimaryRays& rays = trace.rays;
  ENFILADE_ASSERT(depth.size() ==
                  static_cast<std::size_t>(rays.width) * static_cast<std::size_t>(rays.height));
  ENFILADE_ASSERT(mask.size() == depth.size());
  const Vec3 sun = computeSunDirection();
  const auto getDepthAt = [&](int column, int row) {
    if (column >= rays.width || row >= rays.height) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(depth[static_cast<std::size_t>(row * rays.width + column)]);
  };
  ShadowPacket packet;
  for (int x = 0; x < rays.width; x += kTileSize) {
    for (int lane = 0; lane < kPacketSize; ++lane) {
      const int column = x + lane % kTileSize, row = y + lane / kTileSize;
      setUpShadowRay(packet, lane, trace, column, row, getDepthAt(column, row), sun);
    }
    for (std::size_t t = 0; t < trace.trees.size(); ++t) {
      FilterContext context = makeFilterContext(trace, t);
      context.byBarycentrics = true;
      // At edges, the origins are far apart. Also, with the coherent flag, rtcOccluded16 of Embree
      // 3.13 never returns for some packets that hit instances.
      context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
      setIgnoredEntity(context, trace);
      rtcOccluded16(packet.valid, trace.trees[t]->embreeScene(), &context.embree, &packet.ray);
      for (int lane = 0; lane < kPacketSize; ++lane) {
        if (packet.valid[lane] == 0 || !(packet.ray.tfar[lane] < 0)) continue;
        mask[packet.ray.id[lane]] = 0;
        packet.valid[lane] = 0;
      }
    }
  }
}

void traceBetween(const TraceContext& trace, double x, double y, double from, double to,
                  std::vector<HitKey>& keys) {
  std::vector<PixelHit> hits;
  for (std::size_t t = 0; t < trace.trees.size(); ++t) {
    FilterContext context = makeFilterContext(trace, t);
    context.hits = &hits;
    context.embree.filter = recordAllHits;
    RTCRayHit query = makePixelRay(trace, x, y, from, to);
    rtcIntersect1(trace.trees[t]->embreeScene(), &context.embree, &query);
  }
  for (const PixelHit& hit : hits) {
    const bool ignored =
        trace.ignoredEntity != 0 && findTriangle(trace, hit.key).batch->id == trace.ignoredEntity;
    if (!ignored) keys.push_back(hit.key);
  }
}

HitKey traceFirst(const TraceContext& trace, double x, double y, double from, double to) {
  RTCRayHit query = makePixelRay(trace, x, y, from, to);
  HitKey key = kNoHit;
  for (std::size_t t = 0; t < trace.trees.size(); ++t) {
    FilterContext context = makeFilterContext(trace, t);
    context.byBarycentrics = true;
    setIgnoredEntity(context, trace);
    rtcIntersect1(trace.trees[t]->embreeScene(), &context.embree, &query);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
    key = makeHitKey(t, query.hit.instID[0], query.hit.geomID, query.hit.primID);
    query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;  // the next must be nearer
  }
  return key == kNoHit || trace.isDepthOnly ? key : chooseCoplanar(trace, x, y, key);
}

bool isInShadow(const TraceContext& trace, double x, double y, double z) {
  ShadowPacket packet;
  setUpShadowRay(packet, 0, trace, x, y, z, computeSunDirection());
  RTCRay ray{};
  ray.org_x = packet.ray.org_x[0], ray.org_y = packet.ray.org_y[0], ray.org_z = packet.ray.org_z[0];
  ray.dir_x = packet.ray.dir_x[0], ray.dir_y = packet.ray.dir_y[0], ray.dir_z = packet.ray.dir_z[0];
  ray.tnear = packet.ray.tnear[0];
  ray.mask = 0xFFFF'FFFFu;
  for (std::size_t t = 0; t < trace.trees.size(); ++t) {
    FilterContext context = makeFilterContext(trace, t);
    context.byBarycentrics = true;
    setIgnoredEntity(context, trace);
    ray.tfar = packet.ray.tfar[0];
    rtcOccluded1(trace.trees[t]->embreeScene(), &context.embree, &ray);
    if (ray.tfar < 0) return true;
  }
  return false;
}

double traceFirstBehind(const TraceContext& trace, int x, int y, double from) {
  RTCRayHit query = makePixelRay(trace, x, y, from, trace.rays.far);
  if (!(query.ray.tnear <= query.ray.tfar)) return std::numeric_limits<double>::quiet_NaN();
  bool isHit = false;
  for (std::size_t t = 0; t < trace.trees.size(); ++t) {
    FilterContext context = makeFilterContext(trace, t);
    setIgnoredEntity(context, trace);
    rtcIntersect1(trace.trees[t]->embreeScene(), &context.embree, &query);
    isHit = isHit || query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  return isHit ? trace.rays.start + static_cast<double>(query.ray.tfar)
               : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace enfilade::render
