#include "render/optical_flow.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <unordered_map>

#include "collision/assert.hpp"
#include "render/camera/camera.hpp"
#include "render/draw_list.hpp"
#include "render/figure.hpp"

namespace enfilade::render {
namespace {

using Motion = std::optional<Eigen::Affine3d>;  ///< from now to then; nullopt: unknown

/// The motions of entities between two snapshots.
class Motions {
 public:
  Motions(const scene::Scene& scene, const scene::Snapshot& now, const scene::Snapshot& then,
          AvatarForm form)
      : objects_(static_cast<scene::EntityId>(scene.model().objects.size())) {
    const std::vector<BodyPlacement> placedNow = computeBodyPlacements(scene, now),
                                     placedThen = computeBodyPlacements(scene, then);
    for (std::size_t i = 0; i < placedNow.size(); ++i) {
      if (placedNow[i] == placedThen[i]) continue;
      const Eigen::Affine3d motion =
          placedThen[i].sceneFromAuthored * placedNow[i].sceneFromAuthored.inverse();
      for (const std::uint32_t object : scene.model().bodies[i].objects)
        motions_[object + 1] = motion;
    }
    for (const scene::AvatarSnapshot& avatar : now.avatars) {
      const auto before = std::ranges::find(then.avatars, avatar.id, &scene::AvatarSnapshot::id);
      Motion& motion = motions_[avatar.id];
      if (before != then.avatars.end() && before->shape == avatar.shape)
        motion = computeMotion(avatar, *before, form);
    }
  }

  Motion find(scene::EntityId id) const {
    const auto found = motions_.find(id);
    if (found != motions_.end()) return found->second;
    return id <= objects_ ? Motion(Eigen::Affine3d::Identity()) : std::nullopt;
  }

 private:
  /// Only the drawn shape of a person turns with the view.
  static Eigen::Affine3d computeMotion(const scene::AvatarSnapshot& now,
                                       const scene::AvatarSnapshot& then, AvatarForm form) {
    if (form == AvatarForm::figure && isPerson(now))
      return placeFigure(then).worldFromMesh * placeFigure(now).worldFromMesh.inverse();
    return Eigen::Affine3d(Eigen::Translation3d(then.footPosition - now.footPosition));
  }

  scene::EntityId objects_;
  std::unordered_map<scene::EntityId, Motion> motions_;
};

}  // namespace

std::vector<float> computeOpticalFlow(const Frame& frame, const scene::Scene& scene,
                                      const scene::Snapshot& now, const scene::Snapshot& then,
                                      const Camera& cameraThen) {
  const Camera& camera = frame.camera;
  ENFILADE_ASSERT(camera.projection == Camera::Projection::perspective && !camera.lens);
  ENFILADE_ASSERT(frame.ids.size() == frame.depth.size());
  const CameraBasis basis = computeCameraBasis(camera);
  const Pinhole pinhole = computeIntrinsics(camera);
  const Motions motions(scene, now, then, frame.avatars);
  std::vector<float> flow(2 * frame.ids.size(), std::numeric_limits<float>::quiet_NaN());
  scene::EntityId id = 0;
  Motion motion;
  for (std::size_t pixel = 0; pixel < frame.ids.size(); ++pixel) {
    if (frame.ids[pixel] == 0) continue;
    if (frame.ids[pixel] != id) id = frame.ids[pixel], motion = motions.find(id);
    if (!motion) continue;
    const auto width = static_cast<std::size_t>(camera.width);
    const double x = static_cast<double>(pixel % width) + 0.5;
    const double y = static_cast<double>(pixel / width) + 0.5;
    const Vec3 ray = basis.forward + (x - pinhole.cx) / pinhole.fx * basis.right -
                     (y - pinhole.cy) / pinhole.fy * basis.up;
    const Vec3 point = camera.eye + static_cast<double>(frame.depth[pixel]) * ray;
    const Vec3 before = project(cameraThen, *motion * point);
    flow[2 * pixel] = static_cast<float>(x - before.x());
    flow[2 * pixel + 1] = static_cast<float>(y - before.y());
  }
  return flow;
}

}  // namespace enfilade::render
