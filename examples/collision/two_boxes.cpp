// Two unit boxes, one turned by 45 degrees about the vertical, come nearer until they penetrate.
#include <iostream>
#include <vector>

#include "collision/narrow_phase/narrow_phase.hpp"
#include "collision/shapes/hull.hpp"

using namespace enfilade::collision;

int main() {
  const std::vector<Vec3> corners{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0},
                                  {0, 0, 1}, {1, 0, 1}, {0, 1, 1}, {1, 1, 1}};
  const Hull box = buildHull(corners);
  Mat3 turned;
  turned << 0.5, 0, 0.5, 0, 1, 0, -0.5, 0, 0.5;
  turned *= 1.4142135623730951;

  const char* const verdicts[] = {"separated", "touching", "penetrating"};
  const char* const deciders[] = {"rounded arithmetic with a proved bound", "exact sums of doubles",
                                  "exact integers"};
  FeatureCache features;  // kept from query to query: the next one starts where this one ended
  for (const double x : {3.0, 1.5, 1.0, 0.5}) {
    const ConvexBody a{box.vertices, Vec3::Zero(), nullptr, &box};
    const ConvexBody b{box.vertices, Vec3(x, 0, 0.5), &turned, &box};
    const Decision decision = decide(a, b, features);
    std::cout << "x = " << x << " m: " << verdicts[static_cast<int>(decision.verdict)]
              << ", distance " << decision.distance << " m (+- " << decision.errorBound << "), by "
              << deciders[static_cast<int>(decision.decidedBy)] << '\n';
  }
}
