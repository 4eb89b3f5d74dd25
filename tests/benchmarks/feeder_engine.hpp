// Interface of a physics engine that runs the parts feeder, for ours and the peers.
#pragma once

#include <memory>

#include "tests/support/parts_feeder.hpp"

namespace enfilade::benchmarks {

class FeederEngine {
 public:
  virtual ~FeederEngine() = default;
  /// Runs one tick of 1/60 s in FeederPlan::substeps.
  virtual void runTick(bool driven) = 0;
  virtual std::vector<testing::PlacedPart> getParts() const = 0;
  virtual testing::Vec3 getTray() const = 0;
};

std::unique_ptr<FeederEngine> makeBulletFeeder(const testing::FeederPlan& plan);
std::unique_ptr<FeederEngine> makeOdeFeeder(const testing::FeederPlan& plan);

}  // namespace enfilade::benchmarks
