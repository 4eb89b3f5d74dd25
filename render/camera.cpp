#include "render/camera.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "render/camera_basis.hpp"

namespace enfilade::render {
namespace {

// Beyond these the picture's single precision says nothing any more.
constexpr double kNearest = 1e-6;  // metres
constexpr double kFarthest = 1e9;  // metres
constexpr int kLargestPicture = 4096;

// Squared sine of the angle below which `forward` and `up` count as parallel (about 1e-6 rad).
constexpr double kParallel = 1e-12;

template <class Value>
std::string badField(const char* field, const Value& value, const char* wanted) {
  std::ostringstream text;
  text << "camera: " << field << " is " << value << "; it must be " << wanted;
  return text.str();
}

std::string badVector(const char* field, const Vec3& value, const char* wanted) {
  std::ostringstream text;
  text << '(' << value.x() << ", " << value.y() << ", " << value.z() << ')';
  return badField(field, text.str(), wanted);
}

std::optional<std::string> badAxes(const Camera& camera) {
  const Vec3& forward = camera.forward;
  const Vec3& up = camera.up;
  const auto usable = [](const Vec3& v) {
    return v.allFinite() && v.stableNorm() > 1e-12 && v.stableNorm() < 1e12;
  };
  if (!usable(forward)) return badVector("forward", forward, "finite and not zero");
  if (!usable(up)) return badVector("up", up, "finite and not zero");
  if (forward.stableNormalized().cross(up.stableNormalized()).squaredNorm() < kParallel) {
    return badVector("up", up, "not parallel to forward");
  }
  return std::nullopt;
}

std::optional<std::string> badDistances(const Camera& camera) {
  const bool perspective = camera.projection == Camera::Projection::perspective;
  if (perspective && !(camera.near >= kNearest)) {
    return badField("near", camera.near, "at least 1e-6 metres for a perspective");
  }
  if (!(std::abs(camera.near) <= kFarthest)) return badField("near", camera.near, "finite");
  if (!(camera.far <= kFarthest)) return badField("far", camera.far, "at most 1e9 metres");
  if (!(camera.far > camera.near)) return badField("far", camera.far, "greater than near");
  return std::nullopt;
}

std::optional<std::string> badPinhole(const Pinhole& pinhole) {
  constexpr double kShortest = 1e-3, kLongest = 1e6, kAside = 1e5;  // pixels
  const auto focal = [](double f) { return f >= kShortest && f <= kLongest; };
  if (!focal(pinhole.fx)) return badField("pinhole.fx", pinhole.fx, "1e-3 to 1e6 pixels");
  if (!focal(pinhole.fy)) return badField("pinhole.fy", pinhole.fy, "1e-3 to 1e6 pixels");
  const auto centre = [](double c) { return std::abs(c) <= kAside; };
  if (!centre(pinhole.cx)) return badField("pinhole.cx", pinhole.cx, "within 1e5 pixels");
  if (!centre(pinhole.cy)) return badField("pinhole.cy", pinhole.cy, "within 1e5 pixels");
  return std::nullopt;
}

std::optional<std::string> badOpening(const Camera& camera) {
  if (camera.projection == Camera::Projection::perspective) {
    if (camera.pinhole) return badPinhole(*camera.pinhole);
    const bool opens = camera.fovY > 0 && camera.fovY < std::numbers::pi;
    if (opens && !badPinhole(intrinsicsOf(camera))) return std::nullopt;
    return badField("fovY", camera.fovY,
                    "between 0 and pi radians, with a focal length of 1e-3 to 1e6 pixels");
  }
  if (camera.pinhole) return badField("pinhole", "given", "absent in an orthographic camera");
  if (camera.heightY >= kNearest && camera.heightY <= kFarthest) return std::nullopt;
  return badField("heightY", camera.heightY, "1e-6 to 1e9 metres");
}

}  // namespace

std::optional<std::string> refusal(const Camera& camera) {
  if (camera.width < 1 || camera.width > kLargestPicture) {
    return badField("width", camera.width, "1..4096 pixels");
  }
  if (camera.height < 1 || camera.height > kLargestPicture) {
    return badField("height", camera.height, "1..4096 pixels");
  }
  if (!(camera.eye.cwiseAbs().maxCoeff() <= kFarthest) || !camera.eye.allFinite()) {
    return badVector("eye", camera.eye, "finite and within 1e9 metres");
  }
  if (auto why = badAxes(camera)) return why;
  if (auto why = badDistances(camera)) return why;
  return badOpening(camera);
}

Pinhole intrinsicsOf(const Camera& camera) {
  if (camera.pinhole) return *camera.pinhole;
  const double focal = camera.height / (2 * std::tan(camera.fovY / 2));
  return {focal, focal, camera.width / 2.0, camera.height / 2.0};
}

Camera firstPerson(const scene::AvatarView& avatar, int width, int height, double fovY) {
  Camera camera;
  camera.eye = avatar.feet + Vec3(0, avatar.eyeHeight, 0);
  camera.forward = avatar.gaze;
  // Who looks straight up or down keeps a picture; which way is up in it is then ours to choose.
  const bool steep = std::hypot(avatar.gaze.x(), avatar.gaze.z()) < 1e-5;
  camera.up = steep ? Vec3::UnitX() : Vec3::UnitY();
  camera.fovY = fovY;
  camera.width = width;
  camera.height = height;
  return camera;
}

Camera plan(const scene::Box& bounds, double floorHeight, double cutHeight, int width, int height) {
  constexpr double kMargin = 1.05;      // of the bounds, so that outer walls keep off the border
  constexpr double kBelowFloor = 0.01;  // metres; a floor exactly at floorHeight is seen
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

View viewOf(const Camera& camera) {
  View view;
  view.forward = camera.forward.stableNormalized();
  view.right = view.forward.cross(camera.up.stableNormalized()).normalized();
  view.up = view.right.cross(view.forward);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  view.scaleY = perspective ? 1 / std::tan(camera.fovY / 2) : 2 / camera.heightY;
  view.scaleX = view.scaleY * camera.height / camera.width;
  view.shiftX = view.shiftY = 0;
  if (perspective && camera.pinhole) {
    const Pinhole& pinhole = *camera.pinhole;
    view.scaleX = 2 * pinhole.fx / camera.width;
    view.scaleY = 2 * pinhole.fy / camera.height;
    view.shiftX = 2 * pinhole.cx / camera.width - 1;
    view.shiftY = 1 - 2 * pinhole.cy / camera.height;
  }
  return view;
}

std::array<Plane, 6> frustumOf(const Camera& camera) {
  const View view = viewOf(camera);
  const bool perspective = camera.projection == Camera::Projection::perspective;
  // |scale * sideways + shift * ahead| <= ahead (perspective) or |scale * sideways| <= 1
  // (orthographic), both ways on both axes.
  const Vec3 ahead = perspective ? view.forward : Vec3::Zero();
  const double one = perspective ? 0 : 1;
  const auto side = [&](const Vec3& sideways) {
    const Vec3 normal = ahead - sideways;
    return Plane{normal, one - normal.dot(camera.eye)};
  };
  const Vec3 aside = view.scaleX * view.right + view.shiftX * ahead;
  const Vec3 upwards = view.scaleY * view.up + view.shiftY * ahead;
  return {side(aside),
          side(-aside),
          side(upwards),
          side(-upwards),
          Plane{view.forward, -view.forward.dot(camera.eye) - camera.near},
          Plane{-view.forward, view.forward.dot(camera.eye) + camera.far}};
}

bool mayBeSeen(const std::array<Plane, 6>& frustum, const scene::Box& box) {
  const Vec3 centre = box.centre();
  const Vec3 half = 0.5 * box.size();
  for (const Plane& plane : frustum) {
    const double reach = plane.normal.cwiseAbs().dot(half);
    // The slack covers single precision in the picture: a box that touches a side is drawn.
    const double slack = 1e-5 * (1 + std::abs(plane.offset));
    if (plane.normal.dot(centre) + plane.offset + reach < -slack) return false;
  }
  return true;
}

}  // namespace enfilade::render
