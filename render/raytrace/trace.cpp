#include "render/raytrace/trace.hpp"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace enfilade::render {
namespace {

constexpr int kLanes = kTile * kTile;  // a packet

// A key: 3 bits of tree, 1 of geometry, 28 of instance (all ones: none), 32 of primitive.
constexpr HitKey kNoInstance = (HitKey{1} << 28) - 1;

HitKey keyOf(std::size_t tree, unsigned instance, unsigned geometry, unsigned primitive) {
  const bool placed = instance != RTC_INVALID_GEOMETRY_ID;
  const HitKey where = placed ? instance : kNoInstance;
  return HitKey{tree} << 61 | HitKey{placed ? 0u : geometry} << 60 | where << 32 | primitive;
}

/// What Embree hands to the filters, its own part first.
struct Context {
  RTCIntersectContext embree;
  const Casting* casting;
  std::size_t tree;                  ///< of casting->trees
  std::vector<Crossing>* crossings;  ///< where all is noted and nothing stops a ray; else null
  bool towardsSun = false;           ///< rays begin at what pixels show
};

Context contextOf(const Casting& casting, std::size_t tree) {
  Context context{{}, &casting, tree, nullptr};
  rtcInitIntersectContext(&context.embree);
  context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  return context;
}

/// Calls `see(lane, triangle's numbers)` for the lanes that a filter is asked about.
template <class See>
void forEachLane(const RTCFilterFunctionNArguments* arguments, const See& see) {
  RTCHitN* hit = arguments->hit;
  const unsigned n = arguments->N;
  for (unsigned i = 0; i < n; ++i) {
    if (arguments->valid[i] == 0) continue;
    see(i, RTCHitN_instID(hit, n, i, 0), RTCHitN_geomID(hit, n, i), RTCHitN_primID(hit, n, i));
  }
}

const Context& contextIn(const RTCFilterFunctionNArguments* arguments) {
  return *reinterpret_cast<const Context*>(arguments->context);
}

void rejectHoles(const RTCFilterFunctionNArguments* arguments) {
  const Context& context = contextIn(arguments);
  const Casting& casting = *context.casting;
  const RayTree& tree = *casting.trees[context.tree];
  forEachLane(
      arguments, [&](unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
        const PieceTriangle which = tree.find(instance, geometry, primitive);
        if (context.towardsSun) {
          const unsigned n = arguments->N;
          const float alpha = casting.shading.alphaAt(which, RTCHitN_u(arguments->hit, n, lane),
                                                      RTCHitN_v(arguments->hit, n, lane));
          if (alpha < which.piece->material->surface[0]) arguments->valid[lane] = 0;
          return;
        }
        const ShadedTriangle triangle(which, casting.rays);
        const auto pixel = static_cast<int>(RTCRayN_id(arguments->ray, arguments->N, lane));
        const int x = pixel % casting.rays.width, y = pixel / casting.rays.width;
        const float alpha = casting.shading.albedo(triangle, x, y)[3];
        if (alpha < triangle.piece->material->surface[0]) arguments->valid[lane] = 0;
      });
}

void rejectThrough(const RTCFilterFunctionNArguments* arguments) {
  const Casting& casting = *contextIn(arguments).casting;
  const RayTree& tree = *casting.trees[contextIn(arguments).tree];
  forEachLane(arguments,
              [&](unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
                if (tree.find(instance, geometry, primitive).piece->id == casting.through)
                  arguments->valid[lane] = 0;
              });
}

void noteAll(const RTCFilterFunctionNArguments* arguments) {
  const Context& context = contextIn(arguments);
  forEachLane(arguments,
              [&](unsigned lane, unsigned instance, unsigned geometry, unsigned primitive) {
                context.crossings->push_back({RTCRayN_id(arguments->ray, arguments->N, lane),
                                              keyOf(context.tree, instance, geometry, primitive)});
                arguments->valid[lane] = 0;
              });
}

/// One pixel's ray, from depth to depth.
RTCRayHit singleRay(const Casting& casting, int x, int y, double from, double to) {
  const PixelRays& rays = casting.rays;
  const Eigen::Vector3f start = (rays.eye - casting.origin + rays.startAt(x, y)).cast<float>();
  const Eigen::Vector3f way = rays.directionAt(x, y).cast<float>();
  RTCRayHit query{};
  query.ray.org_x = start.x(), query.ray.org_y = start.y(), query.ray.org_z = start.z();
  query.ray.dir_x = way.x(), query.ray.dir_y = way.y(), query.ray.dir_z = way.z();
  query.ray.tnear = static_cast<float>(std::max(0.0, from - rays.start));
  query.ray.tfar = static_cast<float>(to - rays.start);
  query.ray.mask = 0xFFFF'FFFFu;
  query.ray.id = static_cast<unsigned>(y * rays.width + x);
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  return query;
}

/// A tile's rays and which of them are in the picture.
struct Packet {
  RTCRayHit16 query;
  alignas(64) int valid[kLanes];
};

void aim(Packet& packet, const Casting& casting, int x0, int y0) {
  const PixelRays& rays = casting.rays;
  const Eigen::Vector3f from = (rays.eye - casting.origin + rays.startAt(x0, y0)).cast<float>();
  const Eigen::Vector3f way = rays.directionAt(x0, y0).cast<float>();
  const Eigen::Vector3f fromX = rays.originX.cast<float>(), fromY = rays.originY.cast<float>();
  const Eigen::Vector3f wayX = rays.directionX.cast<float>(), wayY = rays.directionY.cast<float>();
  RTCRay16& ray = packet.query.ray;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int column = lane % kTile, row = lane / kTile;
    const auto x = static_cast<float>(column), y = static_cast<float>(row);
    ray.org_x[lane] = from.x() + x * fromX.x() + y * fromY.x();
    ray.org_y[lane] = from.y() + x * fromX.y() + y * fromY.y();
    ray.org_z[lane] = from.z() + x * fromX.z() + y * fromY.z();
    ray.dir_x[lane] = way.x() + x * wayX.x() + y * wayY.x();
    ray.dir_y[lane] = way.y() + x * wayX.y() + y * wayY.y();
    ray.dir_z[lane] = way.z() + x * wayX.z() + y * wayY.z();
    const bool inside = x0 + column < rays.width && y0 + row < rays.height;
    packet.valid[lane] = inside ? -1 : 0;
    // Embree 3.13 casts lanes that are not valid, too, where rays are said to be coherent: such
    // rays end before they begin.
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

void intersect(Packet& packet, const Casting& casting, Context& context) {
  rtcIntersect16(packet.valid, casting.trees[context.tree]->embree(), &context.embree,
                 &packet.query);
}

}  // namespace

EmbreeFilter maskFilter() {
  return rejectHoles;
}

PieceTriangle triangleOf(const Casting& casting, HitKey key) {
  const HitKey where = key >> 32 & kNoInstance;
  const unsigned instance =
      where == kNoInstance ? RTC_INVALID_GEOMETRY_ID : static_cast<unsigned>(where);
  return casting.trees[key >> 61]->find(instance, static_cast<unsigned>(key >> 60 & 1),
                                        static_cast<unsigned>(key & 0xFFFF'FFFFu));
}

void castRows(const Casting& casting, int y, std::vector<HitKey>& keys) {
  const auto width = static_cast<std::size_t>(casting.rays.width);
  keys.assign(width * kTile, kMissed);
  Packet packet;
  for (int x = 0; x < casting.rays.width; x += kTile) {
    aim(packet, casting, x, y);
    for (std::size_t t = 0; t < casting.trees.size(); ++t) {
      Context context = contextOf(casting, t);
      if (casting.through != 0) context.embree.filter = rejectThrough;
      intersect(packet, casting, context);
      RTCHit16& hit = packet.query.hit;
      for (std::size_t lane = 0; lane < kLanes; ++lane) {
        if (hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID) continue;
        const std::size_t column = static_cast<std::size_t>(x) + lane % kTile;
        keys[lane / kTile * width + column] =
            keyOf(t, hit.instID[0][lane], hit.geomID[lane], hit.primID[lane]);
        // The next tree overwrites this one only where it is nearer.
        hit.geomID[lane] = hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
      }
    }
  }
}

void castThroughRows(const Casting& casting, int y, const std::vector<float>& depth,
                     std::vector<Crossing>& crossings) {
  Packet packet;
  for (int x = 0; x < casting.rays.width; x += kTile) {
    aim(packet, casting, x, y);
    for (std::size_t lane = 0; lane < kLanes; ++lane) {
      if (packet.valid[lane] == 0) continue;
      const double z = static_cast<double>(depth[packet.query.ray.id[lane]]) - casting.rays.start;
      // Embree's own distances are only good to floats.
      if (!std::isnan(z)) packet.query.ray.tfar[lane] = static_cast<float>(z * 1.0001 + 1e-4);
    }
    for (std::size_t t = 0; t < casting.trees.size(); ++t) {
      Context context = contextOf(casting, t);
      context.crossings = &crossings;
      context.embree.filter = noteAll;
      intersect(packet, casting, context);
    }
  }
}

namespace {

/// How far a parallel camera lets a ray towards the sun go before it has cut away what is there.
double endOfSight(const PixelRays& rays, double z, const Vec3& sun) {
  constexpr double kEndless = std::numeric_limits<double>::infinity();
  const double along = sun.dot(rays.forward);
  if (!rays.parallel || along == 0) return kEndless;
  return ((along > 0 ? rays.far : rays.near) - z) / along;
}

/// A tile's rays towards the sun, and which of them there are.
struct SunPacket {
  RTCRay16 ray{};
  alignas(64) int valid[kLanes];
};

/// Aims a lane from what its pixel shows at the sun; a NaN `z`: at nothing. The way to the eye is
/// free, so the ray begins a little along it, outside of the surface whatever floats made of
/// either; and what still grazes the surface itself lies within the ray's first millimetre.
void aimAtSun(SunPacket& packet, int lane, const Casting& casting, int x, int y, double z,
              const Vec3& sun) {
  const PixelRays& rays = casting.rays;
  const bool lit = !std::isnan(z);
  const double before = lit ? z - 1e-4 * std::abs(z) : rays.start;
  const Vec3 start =
      rays.eye - casting.origin + rays.originAt(x, y) + before * rays.directionAt(x, y);
  RTCRay16& ray = packet.ray;
  ray.org_x[lane] = static_cast<float>(start.x());
  ray.org_y[lane] = static_cast<float>(start.y());
  ray.org_z[lane] = static_cast<float>(start.z());
  ray.dir_x[lane] = static_cast<float>(sun.x());
  ray.dir_y[lane] = static_cast<float>(sun.y());
  ray.dir_z[lane] = static_cast<float>(sun.z());
  ray.tnear[lane] = static_cast<float>(1e-3 + 2e-6 * start.cwiseAbs().maxCoeff());
  // Others end before they begin, as in aim().
  ray.tfar[lane] = lit ? static_cast<float>(endOfSight(rays, before, sun)) : -1.0f;
  ray.mask[lane] = 0xFFFF'FFFFu;
  ray.id[lane] = static_cast<unsigned>(y * rays.width + x);
  packet.valid[lane] = lit ? -1 : 0;
}

}  // namespace

void castSunRows(const Casting& casting, int y, const std::vector<float>& depth,
                 std::vector<std::uint8_t>& sunlit) {
  const PixelRays& rays = casting.rays;
  const Vec3 sun = towardsSun();
  const auto depthAt = [&](int column, int row) {
    if (column >= rays.width || row >= rays.height) return std::numeric_limits<double>::quiet_NaN();
    return static_cast<double>(depth[static_cast<std::size_t>(row * rays.width + column)]);
  };
  SunPacket packet;
  for (int x = 0; x < rays.width; x += kTile) {
    for (int lane = 0; lane < kLanes; ++lane) {
      const int column = x + lane % kTile, row = y + lane / kTile;
      aimAtSun(packet, lane, casting, column, row, depthAt(column, row), sun);
    }
    for (std::size_t t = 0; t < casting.trees.size(); ++t) {
      Context context = contextOf(casting, t);
      context.towardsSun = true;
      // They begin far apart at edges. And told that they are coherent, Embree 3.13 does not come
      // back from rtcOccluded16 with some packets that meet instances.
      context.embree.flags = RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
      if (casting.through != 0) context.embree.filter = rejectThrough;
      rtcOccluded16(packet.valid, casting.trees[t]->embree(), &context.embree, &packet.ray);
      for (int lane = 0; lane < kLanes; ++lane) {
        if (packet.valid[lane] == 0 || !(packet.ray.tfar[lane] < 0)) continue;
        sunlit[packet.ray.id[lane]] = 0;
        packet.valid[lane] = 0;
      }
    }
  }
}

void castBetween(const Casting& casting, int x, int y, double from, double to,
                 std::vector<HitKey>& keys) {
  std::vector<Crossing> crossings;
  for (std::size_t t = 0; t < casting.trees.size(); ++t) {
    Context context = contextOf(casting, t);
    context.crossings = &crossings;
    context.embree.filter = noteAll;
    RTCRayHit query = singleRay(casting, x, y, from, to);
    rtcIntersect1(casting.trees[t]->embree(), &context.embree, &query);
  }
  for (const Crossing& crossing : crossings) {
    const bool passed =
        casting.through != 0 && triangleOf(casting, crossing.key).piece->id == casting.through;
    if (!passed) keys.push_back(crossing.key);
  }
}

double castBehind(const Casting& casting, int x, int y, double from) {
  RTCRayHit query = singleRay(casting, x, y, from, casting.rays.far);
  if (!(query.ray.tnear <= query.ray.tfar)) return std::numeric_limits<double>::quiet_NaN();
  bool met = false;
  for (std::size_t t = 0; t < casting.trees.size(); ++t) {
    Context context = contextOf(casting, t);
    if (casting.through != 0) context.embree.filter = rejectThrough;
    rtcIntersect1(casting.trees[t]->embree(), &context.embree, &query);
    met = met || query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
  }
  return met ? casting.rays.start + static_cast<double>(query.ray.tfar)
             : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace enfilade::render
