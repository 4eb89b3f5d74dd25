#include "tests/benchmarks/box_methods.hpp"

#include <limits>
#include <utility>

namespace enfilade::benchmarks {
namespace {

using collision::AabbMethod;
using collision::ExtremalVertices;
using collision::SupportTable;

class OurBoxUpdate : public BoxUpdate {
 public:
  OurBoxUpdate(const Hull& hull, SupportTable table, std::size_t bodies)
      : hull_(hull), table_(std::move(table)), last_(bodies) {}

  void update(const std::vector<TurnedPose>& poses, std::vector<Aabb>& boxes) override {
    for (std::size_t k = 0; k < poses.size(); ++k)
      boxes[k] = collision::computeAabb(hull_, table_, poses[k].rotation, poses[k].translation,
                                        last_[k], looked_);
  }
  std::uint64_t getExaminedVertices() const override { return looked_; }

 private:
  const Hull& hull_;
  SupportTable table_;
  std::vector<ExtremalVertices> last_;
  std::uint64_t looked_ = 0;
};

/// The product's code before the three methods, with its bound of the rounding.
class RecomputeUpdate : public BoxUpdate {
 public:
  explicit RecomputeUpdate(const Hull& hull) : hull_(hull) {}

  void update(const std::vector<TurnedPose>& poses, std::vector<Aabb>& boxes) override {
    for (std::size_t k = 0; k < poses.size(); ++k) {
      Aabb box;
      for (const Vec3& v : hull_.vertices)
        box.include(Vec3(poses[k].rotation * v + poses[k].translation));
      const double extent = 2 * hull_.radius + poses[k].translation.cwiseAbs().maxCoeff();
      boxes[k] = collision::inflate(box, 0x1p-49 * extent);
    }
    looked_ += poses.size() * hull_.vertices.size();
  }
  std::uint64_t getExaminedVertices() const override { return looked_; }

 private:
  const Hull& hull_;
  std::uint64_t looked_ = 0;
};

}  // namespace

std::vector<BoxMethod> makeBoxMethods() {
  std::vector<BoxMethod> all;
  for (const auto method : {AabbMethod::sphereCube, AabbMethod::vertexScan, AabbMethod::hillClimb})
    all.push_back({getName(method), [method](const Hull& hull, std::size_t bodies) {
                     return std::make_unique<OurBoxUpdate>(
                         hull, collision::buildSupportTable(hull, method), bodies);
                   }});
  all.push_back({kClimbAlways, [](const Hull& hull, std::size_t bodies) {
                   SupportTable table = collision::buildSupportTable(hull, AabbMethod::hillClimb);
                   table.minTurnTrace = -std::numeric_limits<double>::infinity();
                   return std::make_unique<OurBoxUpdate>(hull, std::move(table), bodies);
                 }});
  all.push_back({"recompute", [](const Hull& hull, std::size_t) {
                   return std::make_unique<RecomputeUpdate>(hull);
                 }});
#ifdef BENCH_BULLET
  all.push_back(makeBulletBoxes());
#endif
#ifdef BENCH_FCL
  all.push_back(makeFclBoxes());
#endif
  return all;
}

}  // namespace enfilade::benchmarks
