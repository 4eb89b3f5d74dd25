// An engine that runs the parts feeder, so that ours and the peers do the same.
#pragma once

#include <memory>

#include "tests/support/parts_feeder.hpp"

namespace enfilade::benchmarks {

class FeederEngine {
 public:
  virtual ~FeederEngine() = default;
  /// One tick of 1/60 s in FeederPlan::substeps.
  virtual void tick(bool driven) = 0;
  virtual std::vector<testing::PlacedPart> parts() const = 0;
  virtual testing::Vec3 tray() const = 0;
};

std::unique_ptr<FeederEngine> makeBulletFeeder(const testing::FeederPlan& plan);
std::unique_ptr<FeederEngine> makeOdeFeeder(const testing::FeederPlan& plan);

}  // namespace enfilade::benchmarks
