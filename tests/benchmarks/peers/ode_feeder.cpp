// Peer: ODE in doubles, convex geoms, its quick step with the default 20 iterations, contacts found
// in every substep.
#include <ode/ode.h>

#include <array>
#include <deque>

#include "tests/benchmarks/feeder_engine.hpp"

namespace enfilade::benchmarks {
namespace {

using testing::FeederPlan;
using testing::PlacedPart;
using testing::Quat;
using testing::Vec3;

constexpr int kMaxContacts = 8;

/// Owns the arrays that a convex geom refers to without a copy.
struct Kind {
  std::vector<dReal> planes, points;
  std::vector<unsigned> polygons;
  unsigned faces = 0, corners = 0;
  scene::MassProperties mass;

  Kind(const std::vector<Vec3>& given, double density) {
    const collision::Hull hull = collision::buildHull(given);
    mass = scene::computeHullMass(hull, density);
    for (const Vec3& v : hull.vertices) {
      const Vec3 p = v - mass.centre;
      points.insert(points.end(), {p.x(), p.y(), p.z()});
    }
    for (const auto& face : hull.faces) {
      const Vec3 a = hull.vertices[face[0]] - mass.centre;
      const Vec3 normal = (hull.vertices[face[1]] - hull.vertices[face[0]])
                              .cross(hull.vertices[face[2]] - hull.vertices[face[0]])
                              .normalized();
      planes.insert(planes.end(), {normal.x(), normal.y(), normal.z(), normal.dot(a)});
      polygons.push_back(static_cast<unsigned>(face.size()));
      polygons.insert(polygons.end(), face.begin(), face.end());
    }
    faces = static_cast<unsigned>(hull.faces.size());
    corners = static_cast<unsigned>(hull.vertices.size());
  }
};

class OdeFeeder : public FeederEngine {
 public:
  explicit OdeFeeder(const FeederPlan& plan) : plan_(plan) {
    dInitODE2(0);
    dAllocateODEDataForThread(dAllocateMaskAll);
    world_ = dWorldCreate();
    space_ = dHashSpaceCreate(nullptr);
    contacts_ = dJointGroupCreate(0);
    dWorldSetGravity(world_, 0, -9.80665, 0);
    addTray();
    for (const auto& corners : plan.kinds) kinds_.emplace_back(corners, plan.density);
    for (const FeederPlan::Part& part : plan.parts) addPart(part);
  }
  ~OdeFeeder() override {
    dJointGroupDestroy(contacts_);
    dSpaceDestroy(space_);
    dWorldDestroy(world_);
    dCloseODE();
  }

  void runTick(bool driven) override {
    const double seconds = 1.0 / 60 / plan_.substeps;
    for (int i = 0; i < plan_.substeps; ++i) {
      const Vec3 velocity =
          (testing::computeTrayPosition(plan_, time_ + seconds, driven) - getTray()) / seconds;
      dBodySetLinearVel(tray_, velocity.x(), velocity.y(), velocity.z());
      dSpaceCollide(space_, this, &OdeFeeder::meet);
      dWorldQuickStep(world_, seconds);
      dJointGroupEmpty(contacts_);
      time_ += seconds;
    }
  }
  std::vector<PlacedPart> getParts() const override {
    std::vector<PlacedPart> placed;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const dReal *p = dBodyGetPosition(bodies_[i]), *q = dBodyGetQuaternion(bodies_[i]);
      const Quat rotation(q[0], q[1], q[2], q[3]);
      const Vec3& centre = kinds_[plan_.parts[i].kind].mass.centre;
      placed.push_back({Vec3(p[0], p[1], p[2]) - rotation * centre, rotation});
    }
    return placed;
  }
  Vec3 getTray() const override {
    const dReal* p = dBodyGetPosition(tray_);
    return {p[0], p[1], p[2]};
  }

 private:
  static void meet(void* self, dGeomID a, dGeomID b) {
    static_cast<OdeFeeder*>(self)->addContacts(a, b);
  }
  void addContacts(dGeomID a, dGeomID b) {
    if (dGeomGetBody(a) == dGeomGetBody(b)) return;
    std::array<dContact, kMaxContacts> contacts{};
    const int count = dCollide(a, b, kMaxContacts, &contacts[0].geom, sizeof(dContact));
    for (int i = 0; i < count; ++i) {
      dContact& contact = contacts[static_cast<std::size_t>(i)];
      contact.surface.mode = dContactApprox1;
      contact.surface.mu = plan_.friction;
      const dJointID joint = dJointCreateContact(world_, contacts_, &contact);
      dJointAttach(joint, dGeomGetBody(a), dGeomGetBody(b));
    }
  }
  void addTray() {
    tray_ = dBodyCreate(world_);
    dBodySetKinematic(tray_);
    for (const auto& box : plan_.tray) {
      const Vec3 size = box[1] - box[0], middle = 0.5 * (box[0] + box[1]);
      const dGeomID geom = dCreateBox(space_, size.x(), size.y(), size.z());
      dGeomSetBody(geom, tray_);
      dGeomSetOffsetPosition(geom, middle.x(), middle.y(), middle.z());
    }
  }
  void addPart(const FeederPlan::Part& part) {
    const Kind& kind = kinds_[part.kind];
    const dBodyID body = dBodyCreate(world_);
    dMass mass;
    const collision::Mat3& i = kind.mass.inertia;
    dMassSetParameters(&mass, kind.mass.mass, 0, 0, 0, i(0, 0), i(1, 1), i(2, 2), i(0, 1), i(0, 2),
                       i(1, 2));
    dBodySetMass(body, &mass);
    const Vec3 centre = part.at + part.rotation * kind.mass.centre;
    dBodySetPosition(body, centre.x(), centre.y(), centre.z());
    const dQuaternion q{part.rotation.w(), part.rotation.x(), part.rotation.y(), part.rotation.z()};
    dBodySetQuaternion(body, q);
    const dGeomID geom = dCreateConvex(space_, kind.planes.data(), kind.faces, kind.points.data(),
                                       kind.corners, kind.polygons.data());
    dGeomSetBody(geom, body);
    bodies_.push_back(body);
  }

  const FeederPlan& plan_;
  double time_ = 0;
  dWorldID world_ = nullptr;
  dSpaceID space_ = nullptr;
  dJointGroupID contacts_ = nullptr;
  dBodyID tray_ = nullptr;
  std::deque<Kind> kinds_;  // geoms point into them
  std::vector<dBodyID> bodies_;
};

}  // namespace

std::unique_ptr<FeederEngine> makeOdeFeeder(const FeederPlan& plan) {
  return std::make_unique<OdeFeeder>(plan);
}

}  // namespace enfilade::benchmarks
