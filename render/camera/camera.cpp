#include "render/camera/camera.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <sstream>

#include "collision/assert.hpp"
#include "render/camera/fisheye.hpp"

namespace enfilade::render {
namespace {

// Beyond these limits, the single precision of a frame is insufficient.
constexpr double kMinNearDistance = 1e-6;  // metres
constexpr double kMaxDistance = 1e9;       // metres
constexpr int kMaxImageSize = 4096;

// Squared sine of the angle below which `forward` and `up` count as parallel (about 1e-6 rad).
constexpr double kMinSineSquared = 1e-12;

template <class Value>
std::string describeInvalidField(const char* field, const Value& value, const char* wanted) {
  std::ostringstream text;
  text << "camera: " << field << " is " << value << "; it must be " << wanted;
  return text.str();
}

std::string describeInvalidVector(const char* field, const Vec3& value, const char* wanted) {
  std::ostringstream text;
  text << '(' << value.x() << ", " << value.y() << ", " << value.z() << ')';
  return describeInvalidField(field, text.str(), wanted);
}

std::optional<std::string> validateAxes(const Camera& camera) {
  const Vec3& forward = camera.forward;
  const Vec3& up = camera.up;
  const auto usable = [](const Vec3& v) {
    return v.allFinite() && v.stableNorm() > 1e-12 && v.stableNorm() < 1e12;
  };
  if (!usable(forward)) return describeInvalidVector("forward", forward, "finite and not zero");
  if (!usable(up)) return describeInvalidVector("up", up, "finite and not zero");
  if (forward.stableNormalized().cross(up.stableNormalized()).squaredNorm() < kMinSineSquared) {
    return describeInvalidVector("up", up, "not parallel to forward");
  }
  return std::nullopt;
}

std::optional<std::string> validateClipDistances(const Camera& camera) {
  const bool perspective = camera.projection == Camera::Projection::perspective;
  if (perspective && !(camera.near >= kMinNearDistance)) {
    return describeInvalidField("near", camera.near, "at least 1e-6 metres for a perspective");
  }
  if (!(std::abs(camera.near) <= kMaxDistance))
    return describeInvalidField("near", camera.near, "finite");
  if (!(camera.far <= kMaxDistance))
    return describeInvalidField("far", camera.far, "at most 1e9 metres");
  if (!(camera.far > camera.near))
    return describeInvalidField("far", camera.far, "greater than near");
  return std::nullopt;
}

std::optional<std::string> validatePinhole(const Pinhole& pinhole) {
  constexpr double kMinFocal = 1e-3, kMaxFocal = 1e6, kMaxCentreOffset = 1e5;  // pixels
  const auto focal = [](double f) { return f >= kMinFocal && f <= kMaxFocal; };
  if (!focal(pinhole.fx))
    return describeInvalidField("pinhole.fx", pinhole.fx, "1e-3 to 1e6 pixels");
  if (!focal(pinhole.fy))
    return describeInvalidField("pinhole.fy", pinhole.fy, "1e-3 to 1e6 pixels");
  const auto centre = [](double c) { return std::abs(c) <= kMaxCentreOffset; };
  if (!centre(pinhole.cx))
    return describeInvalidField("pinhole.cx", pinhole.cx, "within 1e5 pixels");
  if (!centre(pinhole.cy))
    return describeInvalidField("pinhole.cy", pinhole.cy, "within 1e5 pixels");
  return std::nullopt;
}

std::optional<std::string> validateLens(const Camera& camera) {
  const Camera::Lens& lens = *camera.lens;
  if (camera.projection != Camera::Projection::perspective)
    return describeInvalidField("lens", "given", "absent in an orthographic camera");
  if (lens.kind == Camera::Lens::Kind::equirectangular)
    return camera.pinhole ? std::optional(describeInvalidField(
                                "pinhole", "given", "absent in an equirectangular camera"))
                          : std::nullopt;
  for (const double k : lens.k)
    if (!(std::abs(k) <= 1e3)) return describeInvalidField("lens.k", k, "within 1000");
  if (camera.pinhole) return validatePinhole(*camera.pinhole);
  if (!(lens.width > 0 && lens.width <= 2 * std::numbers::pi))
    return describeInvalidField("lens.width", lens.width, "above 0, up to 2 pi radians");
  if (validatePinhole(computeFisheyeIntrinsics(camera)))
    return describeInvalidField("lens.k", lens.k[0], "such that the model increases up to width");
  return std::nullopt;
}

std::optional<std::string> validateFieldOfView(const Camera& camera) {
  if (camera.lens) return validateLens(camera);
  if (camera.projection == Camera::Projection::perspective) {
    if (camera.pinhole) return validatePinhole(*camera.pinhole);
    const bool opens = camera.fovY > 0 && camera.fovY < std::numbers::pi;
    if (opens && !validatePinhole(computeIntrinsics(camera))) return std::nullopt;
    return describeInvalidField(
        "fovY", camera.fovY, "between 0 and pi radians, with a focal length of 1e-3 to 1e6 pixels");
  }
  if (camera.pinhole)
    return describeInvalidField("pinhole", "given", "absent in an orthographic camera");
  if (camera.heightY >= kMinNearDistance && camera.heightY <= kMaxDistance) return std::nullopt;
  return describeInvalidField("heightY", camera.heightY, "1e-6 to 1e9 metres");
}

}  // namespace

std::optional<std::string> validateCamera(const Camera& camera) {
  if (camera.width < 1 || camera.width > kMaxImageSize) {
    return describeInvalidField("width", camera.width, "1..4096 pixels");
  }
  if (camera.height < 1 || camera.height > kMaxImageSize) {
    return describeInvalidField("height", camera.height, "1..4096 pixels");
  }
  if (!(camera.eye.cwiseAbs().maxCoeff() <= kMaxDistance) || !camera.eye.allFinite()) {
    return describeInvalidVector("eye", camera.eye, "finite and within 1e9 metres");
  }
  if (auto error = validateAxes(camera)) return error;
  if (auto error = validateClipDistances(camera)) return error;
  return validateFieldOfView(camera);
}

Pinhole computeIntrinsics(const Camera& camera) {
  if (camera.pinhole) return *camera.pinhole;
  const double focal = camera.height / (2 * std::tan(camera.fovY / 2));
  return {focal, focal, camera.width / 2.0, camera.height / 2.0};
}

Pinhole computeFisheyeIntrinsics(const Camera& camera) {
  ENFILADE_ASSERT(camera.lens && camera.lens->kind == Camera::Lens::Kind::fisheye);
  if (camera.pinhole) return *camera.pinhole;
  const double focal = 0.5 * camera.width / distort(camera.lens->k, 0.5 * camera.lens->width);
  return {focal, focal, 0.5 * camera.width, 0.5 * camera.height};
}

Camera makeFirstPersonCamera(const scene::AvatarSnapshot& avatar, int width, int height,
                             double fovY) {
  Camera camera;
  camera.eye = avatar.footPosition + Vec3(0, avatar.eyeHeight, 0);
  camera.forward = avatar.viewDirection;
  // If the avatar looks straight up or down, any horizontal up vector is valid.
  const bool steep = std::hypot(avatar.viewDirection.x(), avatar.viewDirection.z()) < 1e-5;
  camera.up = steep ? Vec3::UnitX() : Vec3::UnitY();
  camera.fovY = fovY;
  camera.width = width;
  camera.height = height;
  return camera;
}

Camera makePlanCamera(const scene::Aabb& bounds, double floorHeight, double cutHeight, int width,
                      int height) {
  constexpr double kMargin = 1.05;      // of the bounds; keeps outer walls off the border
  constexpr double kBelowFloor = 0.01;  // metres; a floor exactly at floorHeight is visible
  constexpr double kNear = 0.05;        // metres
  Camera camera;
  camera.projection = Camera::Projection::orthographic;
  camera.eye = Vec3(bounds.centre().x(), cutHeight + kNear, bounds.centre().z());
  camera.forward = -Vec3::UnitY();
  camera.up = -Vec3::UnitZ();
  camera.near = kNear;
  camera.far = kNear + (cutHeight - floorHeight) + kBelowFloor;
  const double heightForWidth = bounds.size().x() * height / std::max(width, 1);
  camera.heightY = kMargin * std::max({bounds.size().z(), heightForWidth, 1e-3});
  camera.width = width;
  camera.height = height;
  return camera;
}

CameraBasis computeCameraBasis(const Camera& camera) {
  CameraBasis basis;
  basis.forward = camera.forward.stableNormalized();
  basis.right = basis.forward.cross(camera.up.stableNormalized()).normalized();
  basis.up = basis.right.cross(basis.forward);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  basis.scaleY = perspective ? 1 / std::tan(camera.fovY / 2) : 2 / camera.heightY;
  basis.scaleX = basis.scaleY * camera.height / camera.width;
  basis.shiftX = basis.shiftY = 0;
  if (perspective && camera.pinhole) {
    const Pinhole& pinhole = *camera.pinhole;
    basis.scaleX = 2 * pinhole.fx / camera.width;
    basis.scaleY = 2 * pinhole.fy / camera.height;
    basis.shiftX = 2 * pinhole.cx / camera.width - 1;
    basis.shiftY = 1 - 2 * pinhole.cy / camera.height;
  }
  return basis;
}

std::array<Plane, 6> computeFrustum(const Camera& camera) {
  const CameraBasis basis = computeCameraBasis(camera);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  // |scale * sideways + shift * ahead| <= ahead (perspective) or |scale * sideways| <= 1
  // (orthographic), both ways on both axes.
  const Vec3 ahead = perspective ? basis.forward : Vec3::Zero();
  const double one = perspective ? 0 : 1;
  const auto side = [&](const Vec3& sideways) {
    const Vec3 normal = ahead - sideways;
    return Plane{normal, one - normal.dot(camera.eye)};
  };
  const Vec3 aside = basis.scaleX * basis.right + basis.shiftX * ahead;
  const Vec3 upwards = basis.scaleY * basis.up + basis.shiftY * ahead;
  return {side(aside),
          side(-aside),
          side(upwards),
          side(-upwards),
          Plane{basis.forward, -basis.forward.dot(camera.eye) - camera.near},
          Plane{-basis.forward, basis.forward.dot(camera.eye) + camera.far}};
}

Vec3 project(const Camera& camera, const Vec3& worldPoint) {
  const CameraBasis basis = computeCameraBasis(camera);
  const Vec3 toPoint = worldPoint - camera.eye;
  const double z = basis.forward.dot(toPoint);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  constexpr double kNowhere = std::numeric_limits<double>::quiet_NaN();
  if (perspective && !(z > 0)) return {kNowhere, kNowhere, z};
  const double shrink = perspective ? z : 1;
  const double x = basis.scaleX * basis.right.dot(toPoint) / shrink + basis.shiftX;
  const double y = basis.scaleY * basis.up.dot(toPoint) / shrink + basis.shiftY;
  return {(1 + x) * camera.width / 2, (1 - y) * camera.height / 2, z};
}

}  // namespace enfilade::render
