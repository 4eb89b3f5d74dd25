// Interface of every benchmarked query of a convex body against a mesh.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "collision/shapes/triangle_tree.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {

using collision::Triangle;
using Triangles = std::vector<Triangle>;

/// Queries of one body against one static mesh, with the state cached between queries.
class MeshQuery {
 public:
  virtual ~MeshQuery() = default;
  /// Metres; 0 if they touch or penetrate.
  virtual double computeDistance(const RigidTransform& body) = 0;
  /// Appends the indices (into the mesh's triangle list) of all triangles that the body touches or
  /// penetrates, in any order.
  virtual void findContacts(const RigidTransform& body, std::vector<std::uint32_t>& triangles) = 0;
  virtual void forget() {}
};

struct MeshMethod {
  std::string name;
  bool ours, warm;
  std::function<std::unique_ptr<MeshQuery>(const Points& body, const Triangles& mesh)> make;
};

std::vector<MeshMethod> makeMeshMethods();

// Factories, one per source file.
std::vector<MeshMethod> makeOurMeshQueries();
std::vector<MeshMethod> makeBulletMeshMethods();
std::vector<MeshMethod> makeFclMeshMethods();

}  // namespace enfilade::benchmarks
