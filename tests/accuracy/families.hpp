// Seeded pairs of small bodies, each family hard in its own way, with the exact answer worked out
// by the judge. The families are not those of the shared cases.
#pragma once

#include <string>
#include <vector>

#include "tests/accuracy/case_file.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::accuracy {

using Random = collision::testing::Random;

struct Family {
  const char* name;
  Case (*make)(Random& random);  ///< without the truth
};

const std::vector<Family>& families();

/// A case of the family, with its truth: verdict, distance, depth, and `near` at a clearance that
/// lies within a few ulps of half the distance.
Case madeCase(const Family& family, Random& random, int number);

/// The truth of any case about two bodies, by the judge.
Truth judged(const Case& asked);

}  // namespace enfilade::accuracy
