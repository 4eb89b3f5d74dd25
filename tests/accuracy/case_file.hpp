// Cases with a known exact answer, one JSON object per line, and the meshes that some refer to.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tests/accuracy/exact_geometry.hpp"

namespace enfilade::accuracy {

using Triangle = std::array<Vec3, 3>;
using Meshes = std::map<std::string, std::vector<Triangle>>;  ///< by name; world, metres

/// Body A's displacement at time s is velocity * s + acceleration * s * s / 2.
struct Course {
  Vec3 velocity = Vec3::Zero();
  Vec3 acceleration = Vec3::Zero();
};

/// The true values in the file. Decimal strings are empty if the file has null or no value.
struct Truth {
  std::string verdict, distance, penetration;
  std::optional<bool> near;
  std::vector<std::uint32_t> penetrated, touched;  ///< triangles of a mesh, ascending
  std::string tc;
  std::optional<std::array<double, 2>> toi;  ///< nullopt: no contact before kLastTime
};

inline constexpr double kLastTime = 64;  ///< seconds; the end of the time range of the files

/// One case: two bodies, or a body and a mesh, with the true values.
struct Case {
  std::string id, family;
  Placed a, b;
  std::string mesh;                 ///< instead of b; empty: b
  std::optional<double> clearance;  ///< "eps": near means distance < 2 * clearance
  std::optional<long> sequence;     ///< cases of one sequence are one coherent motion, in order
  std::optional<Course> course;     ///< requests the time of impact
  Truth truth;
};

/// Both throw std::runtime_error that names file and line.
std::vector<Case> readCases(const std::filesystem::path& file);
Meshes readMeshes(const std::filesystem::path& file);

}  // namespace enfilade::accuracy
