// Moves two unit boxes, one rotated by 45 degrees about Y, towards each other until they penetrate.
#include <iostream>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"

using namespace enfilade::collision;

int main() {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  const Hull box = buildHull(corners);
  Mat3 rotation;
  rotation << 0.5, 0, 0.5, 0, 1, 0, -0.5, 0, 0.5;
  rotation *= 1.4142135623730951;

  const char* const verdicts[] = {"separated", "touching", "penetrating"};
  const char* const deciders[] = {"floating point with an error bound",
                                  "exact floating-point "
                                  "expansions",
                                  "exact integers"};
  FeatureCache features;  // warm start: each query starts from the features of the last
  for (const double x : {3.0, 1.5, 1.0, 0.5}) {
    const PlacedConvex a{box.vertices, Vec3::Zero(), nullptr, &box};
    const PlacedConvex b{box.vertices, Vec3(x, 0, 0.5), &rotation, &box};
    const SeparationResult result = computeSeparation(a, b, features);
    std::cout << "x = " << x << " m: " << verdicts[static_cast<int>(result.verdict)]
              << ", distance " << result.distance << " m (+- " << result.errorBound << "), by "
              << deciders[static_cast<int>(result.certificate)] << '\n';
  }
}
