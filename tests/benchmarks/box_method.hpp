// Interface of every benchmarked way to compute the box of a turning body.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "collision/shapes/hull.hpp"

namespace enfilade::benchmarks {

using collision::Aabb;
using collision::Hull;
using collision::Mat3;
using collision::Quat;
using collision::Vec3;

struct TurnedPose {
  Quat orientation;
  Mat3 rotation;  ///< of `orientation`
  Vec3 translation;
};

/// The boxes of `bodies` bodies with the same hull.
class BoxUpdate {
 public:
  virtual ~BoxUpdate() = default;
  virtual void update(const std::vector<TurnedPose>& poses, std::vector<Aabb>& boxes) = 0;
  /// Vertices that all updates so far looked at; 0 if unknown.
  virtual std::uint64_t getExaminedVertices() const { return 0; }
};

struct BoxMethod {
  std::string name;
  std::function<std::unique_ptr<BoxUpdate>(const Hull& hull, std::size_t bodies)> make;
};

// Factories of the peers, one per source file.
BoxMethod makeBulletBoxes();
BoxMethod makeFclBoxes();

}  // namespace enfilade::benchmarks
