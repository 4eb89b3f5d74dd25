// Runs broad phases on the same recorded boxes, and times and checks each tick.
//
// Methods run in turns of some dozens of ticks, so that a disturbance of the machine affects all of
// them. A tick is timed from the new boxes to all reported pairs. Number and sum of mixed ids of
// its pairs are compared with the expected ones. A method stops when its time is used up.
//
// The boxes are run several times with newly built methods. A tick counts with its minimum time, as
// all runs do the same work and a busy machine only adds time. Methods with a long build time run
// once.
#pragma once

#include <span>
#include <vector>

#include "tests/benchmarks/broad_phase_method.hpp"

namespace enfilade::benchmarks {

/// The boxes of all ticks, and their expected pairs.
struct RecordedBoxes {
  std::vector<std::vector<Aabb>> boxes;
  std::vector<PairTally> pairs;
};

struct BroadPhaseRun {
  const BroadPhaseMethod* method = nullptr;
  std::unique_ptr<BroadPhase> phase;  ///< null after the run
  double buildSeconds = 0;
  /// The method's heap without the static boxes themselves, before dynamic boxes are added: 48
  /// bytes a box are subtracted if the method copied them.
  double bytesAnObject = 0;
  double spent = 0;                  ///< seconds
  double firstTick = 0;              ///< seconds; it inserts all dynamic boxes
  std::vector<double> microseconds;  ///< by tick; 0 if not timed
  std::size_t tick = 0, wrong = 0;
};

/// Runs all methods. Each gets `secondsAMethod` for its ticks, and at least a few ticks.
std::vector<BroadPhaseRun> runMethods(std::span<const BroadPhaseMethod* const> methods,
                                      std::span<const Aabb> staticBoxes,
                                      const RecordedBoxes& recorded, double secondsAMethod);

const char* getKindName(BroadPhaseMethod::Kind kind);

}  // namespace enfilade::benchmarks
