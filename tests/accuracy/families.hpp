// Seeded pairs of small bodies. Each family tests one difficulty; the exact reference computes the
// true values. The families differ from those of the shared cases.
#pragma once

#include <string>
#include <vector>

#include "tests/accuracy/case_file.hpp"
#include "tests/collision/random_shapes.hpp"

namespace enfilade::accuracy {

using Random = collision::testing::Random;

struct Family {
  const char* name;
  Case (*make)(Random& random);  ///< leaves Case::truth empty
};

const std::vector<Family>& getFamilies();

/// Makes a case of the family with its true verdict, distance and depth. With `near` the case has a
/// clearance within a few ulps of half the distance.
Case makeCase(const Family& family, Random& random, int number);

/// Computes the true values of any case of two bodies with the exact reference.
Truth computeTruth(const Case& testCase);

}  // namespace enfilade::accuracy
