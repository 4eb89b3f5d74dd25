// The benchmarked ways to compute the box of a turning body: ours, and the peers that are
// installed.
#pragma once

#include "collision/bounds/bounding_box.hpp"
#include "tests/benchmarks/box_method.hpp"

namespace enfilade::benchmarks {

inline const char* getName(collision::AabbMethod method) {
  switch (method) {
    case collision::AabbMethod::sphereCube:
      return "sphere cube";
    case collision::AabbMethod::vertexScan:
      return "vertex scan";
    case collision::AabbMethod::hillClimb:
      return "climb or scan";
  }
  return "";
}

inline constexpr const char* kClimbAlways = "hill climb";

/// Our three methods, "hill climb" (after each turn), "recompute" (every vertex by a matrix
/// product, as before them), the peers.
std::vector<BoxMethod> makeBoxMethods();

}  // namespace enfilade::benchmarks
