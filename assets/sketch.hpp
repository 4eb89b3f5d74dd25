// A model under construction: shapes are placed under a path; equal meshes are stored once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "assets/moving_part.hpp"
#include "assets/painted_mesh.hpp"
#include "scene/model/model.hpp"

namespace enfilade::assets {

class Sketch {
 public:
  Sketch();

  /// Throws std::logic_error if the path is in use, which is a programming error.
  void place(const std::string& path, const PaintedMesh& shape,
             const Eigen::Affine3d& worldFromShape);
  /// The mesh is centred, so that equal boxes share it.
  void placeBox(const std::string& path, const Vec3& low, const Vec3& high,
                const BoxPaints& paints);
  void placeBox(const std::string& path, const Vec3& low, const Vec3& high, Paint paint);
  /// Sets the joint of the object placed last.
  void setJoint(MovingPart::Kind kind, const Vec3& axis, double low, double high);

  std::size_t size() const { return model_.objects.size(); }
  scene::Model& model() { return model_; }
  std::vector<MovingPart>& movingParts() { return movingParts_; }

 private:
  std::uint32_t findOrAddMesh(const PaintedMesh::Part& part, const std::string& name);

  scene::Model model_;
  std::vector<MovingPart> movingParts_;
  std::map<std::string, std::uint32_t> meshes_;  ///< keyed by their bytes
  std::set<std::string> paths_;
};

/// "name07": two digits, so that names sort by number.
std::string appendNumber(const std::string& name, int number);

}  // namespace enfilade::assets
