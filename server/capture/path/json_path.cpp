// Camera paths in JSON: a list of poses, nerfstudio's transforms.json. The shapes are in
// CAPTURE.md.
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "protocol/json_depth.hpp"
#include "server/capture/path/camera_path.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::json;

constexpr double kSquare = 1e-3;                   // a rotation's entries may be off by so much
constexpr double kFarthest = 1e9;                  // metres
constexpr double kRadians = 0.017453292519943295;  // a degree
constexpr double kHalfTurn = 3.141592653589793;
constexpr std::size_t kMostPoses = 10'000'000;
constexpr std::size_t kLongestQuote = 60;

/// Where a value stands in the file, as "path.json: frames[3].eye".
struct Place {
  std::string text;

  Place at(std::size_t index) const { return {text + "[" + std::to_string(index) + "]"}; }
  Place of(const char* key) const { return {text + (text.ends_with(": ") ? "" : ".") + key}; }
  [[noreturn]] void refuse(const std::string& what) const {
    throw CameraPathError(text + ": " + what);
  }
};

std::string excerpt(const Json& value) {
  if (protocol::isDeeper(value, protocol::kDeepestNest)) return "so deep a nest of lists";
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kLongestQuote) text = text.substr(0, kLongestQuote) + "...";
  return text;
}

double numberOf(const Json& value, const Place& place) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    place.refuse("must be a finite number, not " + excerpt(value));
  return value.get<double>();
}

template <std::size_t count>
std::array<double, count> numbersOf(const Json& value, const Place& place) {
  if (!value.is_array() || value.size() != count)
    place.refuse("must be " + std::to_string(count) + " numbers, not " + excerpt(value));
  std::array<double, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) numbers[i] = numberOf(value[i], place.at(i));
  return numbers;
}

Vec3 vectorOf(const Json& value, const Place& place) {
  const auto numbers = numbersOf<3>(value, place);
  const Vec3 vector(numbers[0], numbers[1], numbers[2]);
  if (!(vector.cwiseAbs().maxCoeff() <= kFarthest)) place.refuse("is beyond 1e9 m");
  return vector;
}

/// Rows of worldFromCamera, three or four of them.
void readMatrix(const Json& value, const Place& place, CameraAxes axes, CameraPose& pose) {
  if (!value.is_array() || value.size() < 3 || value.size() > 4)
    place.refuse("must be 3 or 4 rows of 4 numbers, not " + excerpt(value));
  for (std::size_t row = 0; row < 3; ++row) {
    const auto numbers = numbersOf<4>(value[row], place.at(row));
    const auto r = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column)
      pose.turned(r, static_cast<Eigen::Index>(column)) = numbers[column];
    pose.eye[r] = numbers[3];
  }
  const Mat3 square = pose.turned.transpose() * pose.turned;
  if (!((square - Mat3::Identity()).cwiseAbs().maxCoeff() <= kSquare))
    place.refuse(
        "its left 3x3 part is no rotation: columns must have length 1 and be square to "
        "one another (scale belongs into the scene)");
  if (pose.turned.determinant() < 0)
    place.refuse("its left 3x3 part mirrors; give a rotation (negate one column)");
  if (!(pose.eye.cwiseAbs().maxCoeff() <= kFarthest)) place.refuse("the eye is beyond 1e9 m");
  pose.turned = withAxes(pose.turned, axes, CameraAxes::opengl);
}

/// Looks along `forward`, with `up` upwards in the picture.
Mat3 lookingAlong(const Vec3& forward, const Vec3& up, const Place& place) {
  const Vec3 back = -forward.stableNormalized();
  const Vec3 right = up.stableNormalized().cross(back);
  if (!(forward.stableNorm() > 1e-12) || !(up.stableNorm() > 1e-12) || !(right.norm() > 1e-6))
    place.refuse("looks along its own up axis, or nowhere; give another \"up\"");
  Mat3 turned;
  turned.col(0) = right.normalized();
  turned.col(1) = back.cross(turned.col(0));
  turned.col(2) = back;
  return turned;
}

/// {"eye":..., and one of "look_at", "forward", "quaternion"}.
void readEye(const Json& entry, const Place& place, CameraAxes axes, CameraPose& pose) {
  pose.eye = vectorOf(entry["eye"], place.of("eye"));
  const Vec3 up = entry.contains("up") ? vectorOf(entry["up"], place.of("up")) : Vec3::UnitY();
  if (entry.contains("look_at")) {
    const Vec3 forward = vectorOf(entry["look_at"], place.of("look_at")) - pose.eye;
    pose.turned = lookingAlong(forward, up, place);
  } else if (entry.contains("forward")) {
    pose.turned = lookingAlong(vectorOf(entry["forward"], place.of("forward")), up, place);
  } else if (entry.contains("quaternion")) {
    const auto xyzw = numbersOf<4>(entry["quaternion"], place.of("quaternion"));
    const double length = std::hypot(std::hypot(xyzw[0], xyzw[1]), std::hypot(xyzw[2], xyzw[3]));
    if (!(std::abs(length - 1) <= 1e-2))
      place.of("quaternion")
          .refuse("its length is " + std::to_string(length) + ", not 1; the order is [x, y, z, w]");
    pose.turned = withAxes(rotationOf(xyzw), axes, CameraAxes::opengl);
  } else {
    place.refuse("says where, but not whither: add \"look_at\", \"forward\" or \"quaternion\"");
  }
}

void requireKnownKeys(const Json& entry, const Place& place) {
  static const std::set<std::string> kKnown{"time", "eye",        "look_at", "forward",
                                            "up",   "quaternion", "fov",     "transform_matrix"};
  for (const auto& [key, value] : entry.items()) {
    if (!kKnown.contains(key))
      place.refuse("\"" + key +
                   "\" is no key of a pose; known are time, eye, look_at, forward, up, quaternion, "
                   "fov, transform_matrix");
  }
}

CameraPose poseOf(const Json& entry, const Place& place, CameraAxes axes, double time) {
  if (!entry.is_object()) place.refuse("must be an object, not " + excerpt(entry));
  CameraPose pose;
  pose.time = entry.contains("time") ? numberOf(entry["time"], place.of("time")) : time;
  if (entry.contains("transform_matrix")) {
    readMatrix(entry["transform_matrix"], place.of("transform_matrix"), axes, pose);
  } else if (entry.contains("eye")) {
    readEye(entry, place, axes, pose);
  } else {
    place.refuse("has no place: add \"eye\":[x,y,z] or \"transform_matrix\"");
  }
  if (entry.contains("fov")) {
    const double degrees = numberOf(entry["fov"], place.of("fov"));
    if (!(degrees > 0 && degrees < 180))
      place.of("fov").refuse("must lie between 0 and 180 degrees");
    pose.fovY = degrees * kRadians;
  }
  return pose;
}

/// From side to side, radians, as Blender's exports tell it; nullopt where the file does not.
std::optional<double> openingOf(const Json& file, const Place& place) {
  if (!file.contains("camera_angle_x")) return std::nullopt;
  const double radians = numberOf(file["camera_angle_x"], place.of("camera_angle_x"));
  if (!(radians > 0 && radians < kHalfTurn))
    place.of("camera_angle_x").refuse("must lie between 0 and pi radians");
  return radians;
}

/// nullopt where the file says nothing of it. Distortion is refused: pictures here have none.
std::optional<PathLens> lensOf(const Json& file, const Place& place) {
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) {
    if (file.contains(key) && numberOf(file[key], place.of(key)) != 0)
      place.of(key).refuse("lens distortion is not drawn; set it to 0, or undistort first");
  }
  const bool byAngle = !file.contains("fl_x") && openingOf(file, place) && file.contains("w");
  if (!file.contains("fl_x") && !byAngle) return std::nullopt;
  const auto number = [&](const char* key, std::optional<double> otherwise) {
    if (file.contains(key)) return numberOf(file[key], place.of(key));
    if (!otherwise) place.refuse(std::string(key) + " is missing beside the lens");
    return *otherwise;
  };
  PathLens lens;
  const double width = number("w", std::nullopt), height = number("h", std::nullopt);
  if (!(width >= 1 && width <= 1e6 && height >= 1 && height <= 1e6))
    place.of("w").refuse("w and h must be pixels, at least 1");
  lens.width = static_cast<int>(width);
  lens.height = static_cast<int>(height);
  lens.pinhole.fx =
      byAngle ? width / 2 / std::tan(*openingOf(file, place) / 2) : number("fl_x", std::nullopt);
  lens.pinhole.fy = number("fl_y", lens.pinhole.fx);
  lens.pinhole.cx = number("cx", width / 2);
  lens.pinhole.cy = number("cy", height / 2);
  if (!(lens.pinhole.fx > 0 && lens.pinhole.fy > 0))
    place.of("fl_x").refuse("fl_x and fl_y must be above 0");
  return lens;
}

/// A frame's own, where it has one: what it leaves out the file says.
std::optional<PathLens> ownLens(const Json& file, const Json& frame, const Place& place) {
  Json both = Json::object();
  for (const char* key :
       {"fl_x", "fl_y", "cx", "cy", "w", "h", "k1", "k2", "k3", "k4", "p1", "p2"}) {
    if (frame.contains(key)) both[key] = frame[key];
  }
  if (both.empty()) return std::nullopt;
  for (const char* key : {"fl_x", "fl_y", "cx", "cy", "w", "h"}) {
    if (!both.contains(key) && file.contains(key)) both[key] = file[key];
  }
  return lensOf(both, place);
}

}  // namespace

CameraPath parseJsonPath(std::string_view text, const std::string& source, CameraAxes axes,
                         double fps) {
  Json file;
  try {
    file = Json::parse(text);
  } catch (const Json::out_of_range&) {
    throw CameraPathError(source + ": a number is beyond what a double holds");
  } catch (const Json::parse_error& error) {
    throw CameraPathError(source + ": byte " + std::to_string(error.byte) +
                          ": is not JSON; a walk script's name ends in .jsonl");
  }
  const Place whole{source + ": "};
  const bool listed = file.is_array();
  if (!listed && !(file.is_object() && file.contains("frames") && file["frames"].is_array()))
    throw CameraPathError(source +
                          ": must be a list of poses, or an object with a list \"frames\" as "
                          "transforms.json has it");
  CameraPath path;
  if (!listed) path.lens = lensOf(file, whole);
  if (!listed && !path.lens) path.fovX = openingOf(file, whole);
  const Json& entries = listed ? file : file["frames"];
  const Place list = listed ? Place{source + ": pose"} : whole.of("frames");
  if (entries.empty() || entries.size() > kMostPoses)
    list.refuse(std::to_string(entries.size()) + " poses; give 1 to 10,000,000");
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const Place place = list.at(i);
    if (listed && entries[i].is_object()) requireKnownKeys(entries[i], place);
    path.poses.push_back(poseOf(entries[i], place, axes, static_cast<double>(i) / fps));
    if (!listed) path.poses.back().lens = ownLens(file, entries[i], place);
    if (i > 0 && !(path.poses[i].time > path.poses[i - 1].time))
      place.of("time").refuse("does not come after the one before; sort the poses by time");
  }
  return path;
}

}  // namespace enfilade::server
