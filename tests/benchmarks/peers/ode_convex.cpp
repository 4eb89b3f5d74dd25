// Peer: ODE's convex against convex, separating axes over faces and edges; contacts with depths, no
// distance. Solids only.
#include <ode/ode.h>

#include <array>

#include "collision/shapes/hull.hpp"
#include "tests/benchmarks/narrow_phase_method.hpp"

namespace enfilade::benchmarks {
namespace {

constexpr int kMaxContacts = 8;

/// Owns the arrays that a convex geom refers to without a copy.
class Shape {
 public:
  explicit Shape(const Points& points) {
    const collision::Hull hull = collision::buildHull(points);
    for (const Vec3& v : hull.vertices) points_.insert(points_.end(), {v.x(), v.y(), v.z()});
    for (const auto& face : hull.faces) addFace(hull, face);
    solid_ = hull.faces.size() >= 4;
    if (!solid_) return;
    geom_ = dCreateConvex(nullptr, planes_.data(), static_cast<unsigned>(hull.faces.size()),
                          points_.data(), static_cast<unsigned>(hull.vertices.size()),
                          polygons_.data());
  }
  ~Shape() {
    if (geom_ != nullptr) dGeomDestroy(geom_);
  }
  Shape(const Shape&) = delete;
  Shape& operator=(const Shape&) = delete;

  void place(const RigidTransform& at) {
    dMatrix3 rotation{};
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) {
        rotation[4 * row + column] = at.rotation(row, column);
      }
    }
    dGeomSetRotation(geom_, rotation);
    dGeomSetPosition(geom_, at.translation.x(), at.translation.y(), at.translation.z());
  }
  dGeomID getGeom() const { return geom_; }

 private:
  void addFace(const collision::Hull& hull, const std::vector<std::uint32_t>& face) {
    const Vec3& a = hull.vertices[face[0]];
    const Vec3 normal = (hull.vertices[face[1]] - a).cross(hull.vertices[face[2]] - a).normalized();
    planes_.insert(planes_.end(), {normal.x(), normal.y(), normal.z(), normal.dot(a)});
    polygons_.push_back(static_cast<unsigned>(face.size()));
    polygons_.insert(polygons_.end(), face.begin(), face.end());
  }

  std::vector<dReal> planes_, points_;
  std::vector<unsigned> polygons_;
  dGeomID geom_ = nullptr;
  bool solid_ = false;
};

class OdePair : public PairOfBodies {
 public:
  OdePair(const Points& a, const Points& b) : a_(a), b_(b) {}

  Answer ask(const RigidTransform& a, const RigidTransform& b) override {
    if (a_.getGeom() == nullptr || b_.getGeom() == nullptr) return {};
    a_.place(a);
    b_.place(b);
    std::array<dContactGeom, kMaxContacts> contacts;
    const int count = dCollide(a_.getGeom(), b_.getGeom(), kMaxContacts, contacts.data(),
                               static_cast<int>(sizeof(dContactGeom)));
    if (count == 0) {
      Answer answer;
      answer.verdict = Answer::Verdict::apart;
      return answer;
    }
    double depth = 0;
    for (int k = 0; k < count; ++k) {
      depth = std::max(depth, contacts[static_cast<std::size_t>(k)].depth);
    }
    return collides(depth);
  }

 private:
  Shape a_, b_;
};

}  // namespace

std::vector<NarrowPhaseMethod> makeOdeConvexMethods() {
  static const int started = dInitODE2(0);
  (void)started;
  return {{"ODE convex", false, "contacts", false, false, true,
           [](const Points& a, const Points& b) -> std::unique_ptr<PairOfBodies> {
             return std::make_unique<OdePair>(a, b);
           }}};
}

}  // namespace enfilade::benchmarks
