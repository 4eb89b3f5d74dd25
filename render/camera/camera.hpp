// The camera is a pose, a projection and an image size. Axes and frustum planes are derived from
// it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "scene/world/data/snapshot.hpp"

namespace enfilade::render {

using collision::Vec3;

/// A pinhole camera's intrinsics in pixels. cx and cy are measured from the image's top left
/// corner, to the right and downwards. The centre of the first pixel is at (0.5, 0.5).
struct Pinhole {
  double fx = 0, fy = 0;  ///< focal lengths, 1e-3..1e6
  double cx = 0, cy = 0;  ///< principal point, possibly outside the image; within 1e5
};

/// Scene frame, metres, radians. The view direction is `forward`; `up` need not be orthogonal to
/// it.
struct Camera {
  enum class Projection : std::uint8_t { perspective, orthographic };

  /// A lens that bends straight lines (lens.hpp). Rays are clipped by their length, not their
  /// depth.
  struct Lens {
    enum class Kind : std::uint8_t {
      fisheye,         ///< OpenCV's fisheye model
      equirectangular  ///< all directions: yaw along the rows, pitch along the columns
    };
    Kind kind = Kind::fisheye;
    std::array<double, 4> k{};              ///< distortion of a fisheye
    double width = 3.14159265358979323846;  ///< of a fisheye without pinhole: radians, 0..2 pi
    /// Pixels to the right and down from the centre of a pixel to the point that it samples.
    double offsetX = 0, offsetY = 0;
  };

  Projection projection = Projection::perspective;
  Vec3 eye = Vec3::Zero();
  Vec3 forward = Vec3::UnitX();
  Vec3 up = Vec3::UnitY();
  double fovY = 1.2;  ///< perspective: vertical field of view, 0 < fovY < pi
  std::optional<Pinhole> pinhole = std::nullopt;  ///< perspective: replaces fovY
  std::optional<Lens> lens = std::nullopt;        ///< perspective; only for RayRenderer
  double heightY = 10;  ///< orthographic: metres from the bottom to the top of the image
  double near = 0.05;   ///< metres along forward; nearer geometry is clipped (used by plans)
  double far = 1000;    ///< metres along forward; > near
  int width = 640, height = 480;  ///< pixels, 1..4096
};

/// A plane; points p with normal.dot(p) + offset >= 0 are inside.
struct Plane {
  Vec3 normal;
  double offset;
};

/// A camera's axes and its mapping from metres to normalised device coordinates (NDC, -1..1).
struct CameraBasis {
  Vec3 right, up, forward;  ///< orthonormal, world frame
  /// From metres to NDC; perspective: at distance 1.
  double scaleX, scaleY;
  /// NDC (right, up) of the principal point; 0 except for pinholes.
  double shiftX, shiftY;
};

/// `camera` must satisfy validateCamera().
inline std::size_t countPixels(const Camera& camera) {
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

/// An error text that names an invalid field and its value; nullopt if the camera is valid.
std::optional<std::string> validateCamera(const Camera& camera);

/// The intrinsics of a perspective camera: its pinhole, otherwise computed from fovY.
Pinhole computeIntrinsics(const Camera& camera);

/// The intrinsics of a fisheye: the camera's pinhole, or those of Lens::width.
Pinhole computeFisheyeIntrinsics(const Camera& camera);

/// The camera at an avatar's eyes. Exclude the avatar itself by FrameOptions::hiddenEntity.
Camera makeFirstPersonCamera(const scene::AvatarSnapshot& avatar, int width, int height,
                             double fovY = 1.2);

/// An orthographic plan of `bounds` from above (x to the right, z downwards in the image). Clips
/// everything above `cutHeight` and below `floorHeight`.
Camera makePlanCamera(const scene::Aabb& bounds, double floorHeight, double cutHeight, int width,
                      int height);

/// `camera` must satisfy validateCamera().
CameraBasis computeCameraBasis(const Camera& camera);

/// The four sides, near and far. A point inside all six planes may be in the image.
std::array<Plane, 6> computeFrustum(const Camera& camera);

/// Projects a world point: x, y are pixels from the top left corner (right, down), z is the
/// z-distance in metres. x, y are NaN for points behind a perspective camera.
Vec3 project(const Camera& camera, const Vec3& worldPoint);

}  // namespace enfilade::render
