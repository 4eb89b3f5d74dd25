// Peer: Embree, with a BVH of the static boxes, a new low-quality one of the movers every tick, and
// its collision of two trees. Its bounds are floats, rounded outwards here; the callback tests the
// exact boxes.
#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

float below(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f
                                     : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float above(double x) {
  return -below(-x);
}

void writeBounds(const RTCBoundsFunctionArguments* args) {
  const Aabb& box =
      static_cast<const std::span<const Aabb>*>(args->geometryUserPtr)->data()[args->primID];
  RTCBounds& b = *args->bounds_o;
  b.lower_x = below(box.min.x());
  b.lower_y = below(box.min.y());
  b.lower_z = below(box.min.z());
  b.upper_x = above(box.max.x());
  b.upper_y = above(box.max.y());
  b.upper_z = above(box.max.z());
}

class EmbreeBvh : public BroadPhase {
 public:
  explicit EmbreeBvh(std::span<const Aabb> still)
      : device_(rtcNewDevice("threads=1,set_affinity=0")), still_(still) {
    rtcSetDeviceMemoryMonitorFunction(device_, countBytes, this);
    stillScene_ = makeScene(&still_, RTC_BUILD_QUALITY_MEDIUM, stillGeometry_);
    rtcCommitScene(stillScene_);
  }
  ~EmbreeBvh() override {
    rtcReleaseScene(stillScene_);
    if (moverScene_ != nullptr) rtcReleaseScene(moverScene_);
    rtcSetDeviceMemoryMonitorFunction(device_, nullptr, nullptr);
    rtcReleaseDevice(device_);
  }
  EmbreeBvh(const EmbreeBvh&) = delete;
  EmbreeBvh& operator=(const EmbreeBvh&) = delete;

  void tick(std::span<const Aabb> movers, PairTally& tally) override {
    movers_ = movers;
    if (moverScene_ == nullptr) {
      moverScene_ = makeScene(&movers_, RTC_BUILD_QUALITY_LOW, moverGeometry_);
    } else {
      rtcCommitGeometry(moverGeometry_);
    }
    rtcCommitScene(moverScene_);
    tally_ = &tally;
    rtcCollide(moverScene_, stillScene_, reportStatic, this);
    rtcCollide(moverScene_, moverScene_, reportDynamic, this);
  }
  std::size_t hiddenBytes() const override { return static_cast<std::size_t>(bytes_); }

 private:
  RTCScene makeScene(std::span<const Aabb>* boxes, RTCBuildQuality quality, RTCGeometry& geometry) {
    RTCScene scene = rtcNewScene(device_);
    rtcSetSceneBuildQuality(scene, quality);
    if (quality == RTC_BUILD_QUALITY_LOW) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_DYNAMIC);
    geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryBuildQuality(geometry, quality);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(boxes->size()));
    rtcSetGeometryUserData(geometry, boxes);
    rtcSetGeometryBoundsFunction(geometry, writeBounds, nullptr);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);  // the scene holds a reference
    return scene;
  }

  static bool countBytes(void* self, ssize_t bytes, bool) {
    static_cast<EmbreeBvh*>(self)->bytes_ += bytes;
    return true;
  }
  static void reportStatic(void* self, RTCCollision* collisions, unsigned count) {
    const auto& bvh = *static_cast<EmbreeBvh*>(self);
    for (unsigned k = 0; k < count; ++k) {
      const RTCCollision& c = collisions[k];
      if (collision::overlaps(bvh.movers_[c.primID0], bvh.still_[c.primID1])) {
        bvh.tally_->addStill(c.primID0, c.primID1);
      }
    }
  }
  static void reportDynamic(void* self, RTCCollision* collisions, unsigned count) {
    const auto& bvh = *static_cast<EmbreeBvh*>(self);
    for (unsigned k = 0; k < count; ++k) {
      const RTCCollision& c = collisions[k];
      if (c.primID0 >= c.primID1) continue;  // each pair is found from both sides
      if (collision::overlaps(bvh.movers_[c.primID0], bvh.movers_[c.primID1])) {
        bvh.tally_->addMovers(c.primID0, c.primID1);
      }
    }
  }

  RTCDevice device_;
  std::span<const Aabb> still_, movers_;
  RTCScene stillScene_ = nullptr, moverScene_ = nullptr;
  RTCGeometry stillGeometry_ = nullptr, moverGeometry_ = nullptr;
  PairTally* tally_ = nullptr;
  std::ptrdiff_t bytes_ = 0;
};

}  // namespace

BroadPhaseMethod embreeBvh() {
  return {"Embree BVH", BroadPhaseMethod::Kind::peer, SIZE_MAX, "", maker<EmbreeBvh>()};
}

}  // namespace enfilade::benchmarks
