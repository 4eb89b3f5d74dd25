// Peer: Bullet in doubles, convex hulls with a margin of 0.5 mm, its default sequential-impulse
// solver, contacts found in every substep.
#include <btBulletDynamicsCommon.h>

#include "tests/benchmarks/feeder_engine.hpp"

namespace enfilade::benchmarks {
namespace {

using testing::FeederPlan;
using testing::PlacedPart;
using testing::Quat;
using testing::Vec3;

constexpr double kMargin = 0.5e-3;

btVector3 toBullet(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
Vec3 fromBullet(const btVector3& v) {
  return {v.x(), v.y(), v.z()};
}

class BulletFeeder : public FeederEngine {
 public:
  explicit BulletFeeder(const FeederPlan& plan) : plan_(plan) {
    world_.setGravity({0, -9.80665, 0});
    addTray();
    for (const auto& corners : plan.kinds) {
      auto shape = std::make_unique<btConvexHullShape>();
      for (const Vec3& corner : corners) shape->addPoint(toBullet(corner), false);
      shape->recalcLocalAabb();
      shape->setMargin(kMargin);
      kinds_.push_back(std::move(shape));
    }
    for (const FeederPlan::Part& part : plan.parts) addPart(part);
  }
  ~BulletFeeder() override {
    for (const auto& body : bodies_) world_.removeRigidBody(body.get());
  }

  void runTick(bool driven) override {
    const double seconds = 1.0 / 60 / plan_.substeps;
    for (int i = 0; i < plan_.substeps; ++i) {
      time_ += seconds;
      btTransform at = btTransform::getIdentity();
      at.setOrigin(toBullet(testing::computeTrayPosition(plan_, time_, driven)));
      trayMotion_.setWorldTransform(at);
      world_.stepSimulation(seconds, 0);
    }
  }
  std::vector<PlacedPart> getParts() const override {
    std::vector<PlacedPart> placed;
    for (std::size_t i = 1; i < bodies_.size(); ++i) {
      const btTransform& at = bodies_[i]->getWorldTransform();
      const btQuaternion q = at.getRotation();
      placed.push_back({fromBullet(at.getOrigin()), Quat(q.w(), q.x(), q.y(), q.z())});
    }
    return placed;
  }
  Vec3 getTray() const override { return fromBullet(bodies_[0]->getWorldTransform().getOrigin()); }

 private:
  void addTray() {
    for (const auto& box : plan_.tray) {
      boxes_.push_back(std::make_unique<btBoxShape>(toBullet(0.5 * (box[1] - box[0]))));
      boxes_.back()->setMargin(kMargin);
      btTransform at = btTransform::getIdentity();
      at.setOrigin(toBullet(0.5 * (box[0] + box[1])));
      trayShape_.addChildShape(at, boxes_.back().get());
    }
    addBody(0, &trayMotion_, &trayShape_, {0, 0, 0});
    bodies_[0]->setCollisionFlags(btCollisionObject::CF_KINEMATIC_OBJECT);
    bodies_[0]->setActivationState(DISABLE_DEACTIVATION);
  }
  void addPart(const FeederPlan::Part& part) {
    btCollisionShape* shape = kinds_[part.kind].get();
    const double volume = computeCollisionVolume(part.kind);
    btVector3 inertia;
    shape->calculateLocalInertia(plan_.density * volume, inertia);
    addBody(plan_.density * volume, nullptr, shape, inertia);
    btTransform at;
    at.setOrigin(toBullet(part.at));
    at.setRotation({part.rotation.x(), part.rotation.y(), part.rotation.z(), part.rotation.w()});
    bodies_.back()->setWorldTransform(at);
  }
  void addBody(double mass, btMotionState* motion, btCollisionShape* shape,
               const btVector3& inertia) {
    bodies_.push_back(std::make_unique<btRigidBody>(mass, motion, shape, inertia));
    bodies_.back()->setFriction(std::sqrt(plan_.friction));  // Bullet multiplies the friction of a
                                                             // pair
    world_.addRigidBody(bodies_.back().get());
  }
  double computeCollisionVolume(std::size_t kind) const {
    return scene::computeHullMass(collision::buildHull(plan_.kinds[kind]), 1).volume;
  }

  const FeederPlan& plan_;
  double time_ = 0;
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_{&configuration_};
  btDbvtBroadphase broadPhase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_{&dispatcher_, &broadPhase_, &solver_, &configuration_};
  btDefaultMotionState trayMotion_;
  btCompoundShape trayShape_;
  std::vector<std::unique_ptr<btBoxShape>> boxes_;
  std::vector<std::unique_ptr<btConvexHullShape>> kinds_;
  std::vector<std::unique_ptr<btRigidBody>> bodies_;
};

}  // namespace

std::unique_ptr<FeederEngine> makeBulletFeeder(const FeederPlan& plan) {
  return std::make_unique<BulletFeeder>(plan);
}

}  // namespace enfilade::benchmarks
