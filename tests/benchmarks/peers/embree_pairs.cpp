// Peer: Embree, with a BVH of the static boxes, a new low-quality one of the dynamic boxes every
// tick, and its collision of two trees. Its bounds are floats, rounded outwards here; the callback
// tests the exact boxes.
#include <embree3/rtcore.h>

#include <cmath>
#include <limits>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

float roundToFloatBelow(double x) {
  const auto f = static_cast<float>(x);
  return static_cast<double>(f) <= x ? f
                                     : std::nextafter(f, -std::numeric_limits<float>::infinity());
}
float roundToFloatAbove(double x) {
  return -roundToFloatBelow(-x);
}

void writeBounds(const RTCBoundsFunctionArguments* args) {
  const Aabb& box =
      static_cast<const std::span<const Aabb>*>(args->geometryUserPtr)->data()[args->primID];
  RTCBounds& b = *args->bounds_o;
  b.lower_x = roundToFloatBelow(box.min.x());
  b.lower_y = roundToFloatBelow(box.min.y());
  b.lower_z = roundToFloatBelow(box.min.z());
  b.upper_x = roundToFloatAbove(box.max.x());
  b.upper_y = roundToFloatAbove(box.max.y());
  b.upper_z = roundToFloatAbove(box.max.z());
}

class EmbreeBvh : public BroadPhase {
 public:
  explicit EmbreeBvh(std::span<const Aabb> staticBoxes)
      : device_(rtcNewDevice("threads=1,set_affinity=0")), staticBoxes_(staticBoxes) {
    rtcSetDeviceMemoryMonitorFunction(device_, countBytes, this);
    staticScene_ = makeScene(&staticBoxes_, RTC_BUILD_QUALITY_MEDIUM, staticGeometry_);
    rtcCommitScene(staticScene_);
  }
  ~EmbreeBvh() override {
    rtcReleaseScene(staticScene_);
    if (dynamicScene_ != nullptr) rtcReleaseScene(dynamicScene_);
    rtcSetDeviceMemoryMonitorFunction(device_, nullptr, nullptr);
    rtcReleaseDevice(device_);
  }
  EmbreeBvh(const EmbreeBvh&) = delete;
  EmbreeBvh& operator=(const EmbreeBvh&) = delete;

  void runTick(std::span<const Aabb> dynamicBoxes, PairTally& tally) override {
    dynamicBoxes_ = dynamicBoxes;
    if (dynamicScene_ == nullptr) {
      dynamicScene_ = makeScene(&dynamicBoxes_, RTC_BUILD_QUALITY_LOW, dynamicGeometry_);
    } else {
      rtcCommitGeometry(dynamicGeometry_);
    }
    rtcCommitScene(dynamicScene_);
    tally_ = &tally;
    rtcCollide(dynamicScene_, staticScene_, reportStatic, this);
    rtcCollide(dynamicScene_, dynamicScene_, reportDynamic, this);
  }
  std::size_t countHiddenBytes() const override { return static_cast<std::size_t>(bytes_); }

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
      if (collision::overlaps(bvh.dynamicBoxes_[c.primID0], bvh.staticBoxes_[c.primID1])) {
        bvh.tally_->addStaticPair(c.primID0, c.primID1);
      }
    }
  }
  static void reportDynamic(void* self, RTCCollision* collisions, unsigned count) {
    const auto& bvh = *static_cast<EmbreeBvh*>(self);
    for (unsigned k = 0; k < count; ++k) {
      const RTCCollision& c = collisions[k];
      if (c.primID0 >= c.primID1) continue;  // each pair is found from both sides
      if (collision::overlaps(bvh.dynamicBoxes_[c.primID0], bvh.dynamicBoxes_[c.primID1])) {
        bvh.tally_->addDynamicPair(c.primID0, c.primID1);
      }
    }
  }

  RTCDevice device_;
  std::span<const Aabb> staticBoxes_, dynamicBoxes_;
  RTCScene staticScene_ = nullptr, dynamicScene_ = nullptr;
  RTCGeometry staticGeometry_ = nullptr, dynamicGeometry_ = nullptr;
  PairTally* tally_ = nullptr;
  std::ptrdiff_t bytes_ = 0;
};

}  // namespace

BroadPhaseMethod makeEmbreeBvh() {
  return {"Embree BVH", BroadPhaseMethod::Kind::peer, SIZE_MAX, "", bindMaker<EmbreeBvh>()};
}

}  // namespace enfilade::benchmarks
