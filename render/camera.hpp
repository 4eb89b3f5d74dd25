// Where a picture is taken from.
#pragma once

#include <optional>
#include <string>

#include "scene/world/data/snapshot.hpp"

namespace enfilade::render {

using collision::Vec3;

/// A pinhole camera's intrinsics in pixels. cx and cy are measured from the top left corner of the
/// picture, to the right and downwards: the centre of the first pixel is at (0.5, 0.5).
struct Pinhole {
  double fx = 0, fy = 0;  ///< focal lengths, 1e-3..1e6
  double cx = 0, cy = 0;  ///< where the axis meets the picture, or beside it: within 1e5
};

/// Scene frame, metres, radians. Looks along `forward`; `up` need not be square to it.
struct Camera {
  enum class Projection : std::uint8_t { perspective, orthographic };

  Projection projection = Projection::perspective;
  Vec3 eye = Vec3::Zero();
  Vec3 forward = Vec3::UnitX();
  Vec3 up = Vec3::UnitY();
  double fovY = 1.2;                              ///< perspective: vertical opening, 0 < fovY < pi
  std::optional<Pinhole> pinhole = std::nullopt;  ///< perspective: in place of fovY
  double heightY = 10;  ///< orthographic: metres from the bottom to the top of the picture
  double near = 0.05;   ///< metres along forward; what is nearer is cut away (plans use it)
  double far = 1000;    ///< metres along forward; > near
  int width = 640, height = 480;  ///< pixels, 1..4096
};

/// Why the camera cannot be used, naming the field and its value; nullopt when it can.
std::optional<std::string> refusal(const Camera& camera);

/// The intrinsics of a perspective camera, those of fovY where it has no pinhole.
Pinhole intrinsicsOf(const Camera& camera);

/// The eyes of an avatar. Its own hull is not drawn in pictures taken with it (see GlRenderer).
Camera firstPerson(const scene::AvatarView& avatar, int width, int height, double fovY = 1.2);

/// A plan: looks straight down at `bounds` (x to the right, z downwards in the picture), cutting
/// away everything above `cutHeight` and below `floorHeight`.
Camera plan(const scene::Box& bounds, double floorHeight, double cutHeight, int width, int height);

}  // namespace enfilade::render
