#include "server/capture/path/json_path.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>

#include "collision/sine_cosine.hpp"
#include "protocol/json_depth.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::json;

constexpr double kRotationTolerance = 1e-3;  // tolerance of a rotation's entries
constexpr std::size_t kMaxQuoteLength = 60;

/// The position of a value in the file, for example "path.json: frames[3].eye".
struct JsonPosition {
  std::string text;

  JsonPosition element(std::size_t index) const {
    return {text + "[" + std::to_string(index) + "]"};
  }
  JsonPosition member(const char* key) const {
    return {text + (text.ends_with(": ") ? "" : ".") + key};
  }
  [[noreturn]] void fail(const std::string& what) const {
    throw CameraPathError(text + ": " + what);
  }
};

std::string makeExcerpt(const Json& value) {
  if (protocol::isDeeperThan(value, protocol::kMaxJsonDepth)) return "a too deeply nested value";
  std::string text = value.dump(-1, ' ', true, Json::error_handler_t::replace);
  if (text.size() > kMaxQuoteLength) text = text.substr(0, kMaxQuoteLength) + "...";
  return text;
}

double parseNumber(const Json& value, const JsonPosition& position) {
  if (!value.is_number() || !std::isfinite(value.get<double>()))
    position.fail("must be a finite number, not " + makeExcerpt(value));
  return value.get<double>();
}

template <std::size_t count>
std::array<double, count> parseNumbers(const Json& value, const JsonPosition& position) {
  if (!value.is_array() || value.size() != count)
    position.fail("must be " + std::to_string(count) + " numbers, not " + makeExcerpt(value));
  std::array<double, count> numbers{};
  for (std::size_t i = 0; i < count; ++i) numbers[i] = parseNumber(value[i], position.element(i));
  return numbers;
}

Vec3 parseVector(const Json& value, const JsonPosition& position) {
  const auto numbers = parseNumbers<3>(value, position);
  const Vec3 vector(numbers[0], numbers[1], numbers[2]);
  if (!(vector.cwiseAbs().maxCoeff() <= kMaxEyeCoordinate)) position.fail("is beyond 1e9 m");
  return vector;
}

/// Reads three or four rows of worldFromCamera.
void readMatrix(const Json& value, const JsonPosition& position, CameraAxes axes,
                CameraPose& pose) {
  if (!value.is_array() || value.size() < 3 || value.size() > 4)
    position.fail("must be 3 or 4 rows of 4 numbers, not " + makeExcerpt(value));
  for (std::size_t row = 0; row < 3; ++row) {
    const auto numbers = parseNumbers<4>(value[row], position.element(row));
    const auto r = static_cast<Eigen::Index>(row);
    for (std::size_t column = 0; column < 3; ++column)
      pose.rotation(r, static_cast<Eigen::Index>(column)) = numbers[column];
    pose.eye[r] = numbers[3];
  }
  const Mat3 square = pose.rotation.transpose() * pose.rotation;
  if (!((square - Mat3::Identity()).cwiseAbs().maxCoeff() <= kRotationTolerance))
    position.fail(
        "its left 3x3 part is not a rotation: columns must have length 1 and be orthogonal "
        "(put the scale into the scene)");
  if (pose.rotation.determinant() < 0)
    position.fail("its left 3x3 part is a reflection; give a rotation (negate one column)");
  if (!(pose.eye.cwiseAbs().maxCoeff() <= kMaxEyeCoordinate))
    position.fail("the eye is beyond 1e9 m");
  pose.rotation = convertAxes(pose.rotation, axes, CameraAxes::opengl);
}

/// Makes the rotation of a camera that looks along `forward`, with `up` upwards in the picture.
Mat3 makeLookRotation(const Vec3& forward, const Vec3& up, const JsonPosition& position) {
  const Vec3 back = -forward.stableNormalized();
  const Vec3 right = up.stableNormalized().cross(back);
  if (!(forward.stableNorm() > 1e-12) || !(up.stableNorm() > 1e-12) || !(right.norm() > 1e-6))
    position.fail("its direction is zero or parallel to \"up\"; give another \"up\"");
  Mat3 rotation;
  rotation.col(0) = right.normalized();
  rotation.col(1) = back.cross(rotation.col(0));
  rotation.col(2) = back;
  return rotation;
}

/// Reads {"eye":..., and one of "look_at", "forward", "quaternion"}.
void readEye(const Json& entry, const JsonPosition& position, CameraAxes axes, CameraPose& pose) {
  pose.eye = parseVector(entry["eye"], position.member("eye"));
  const Vec3 up =
      entry.contains("up") ? parseVector(entry["up"], position.member("up")) : Vec3::UnitY();
  if (entry.contains("look_at")) {
    const Vec3 forward = parseVector(entry["look_at"], position.member("look_at")) - pose.eye;
    pose.rotation = makeLookRotation(forward, up, position);
  } else if (entry.contains("forward")) {
    pose.rotation =
        makeLookRotation(parseVector(entry["forward"], position.member("forward")), up, position);
  } else if (entry.contains("quaternion")) {
    const auto xyzw = parseNumbers<4>(entry["quaternion"], position.member("quaternion"));
    const double length = std::hypot(std::hypot(xyzw[0], xyzw[1]), std::hypot(xyzw[2], xyzw[3]));
    if (!(std::abs(length - 1) <= 1e-2))
      position.member("quaternion")
          .fail("its length is " + std::to_string(length) + ", not 1; the order is [x, y, z, w]");
    pose.rotation = convertAxes(toRotation(xyzw), axes, CameraAxes::opengl);
  } else {
    position.fail("has no direction: add \"look_at\", \"forward\" or \"quaternion\"");
  }
}

void requireKnownKeys(const Json& entry, const JsonPosition& position) {
  static const std::set<std::string> kKnown{"time", "eye",        "look_at", "forward",
                                            "up",   "quaternion", "fov",     "transform_matrix"};
  for (const auto& [key, value] : entry.items()) {
    if (!kKnown.contains(key))
      position.fail("\"" + key +
                    "\" is not a key of a pose; keys are time, eye, look_at, forward, up, "
                    "quaternion, "
                    "fov, transform_matrix");
  }
}

CameraPose parsePose(const Json& entry, const JsonPosition& position, CameraAxes axes,
                     double time) {
  if (!entry.is_object()) position.fail("must be an object, not " + makeExcerpt(entry));
  CameraPose pose;
  pose.time = entry.contains("time") ? parseNumber(entry["time"], position.member("time")) : time;
  if (entry.contains("transform_matrix")) {
    readMatrix(entry["transform_matrix"], position.member("transform_matrix"), axes, pose);
  } else if (entry.contains("eye")) {
    readEye(entry, position, axes, pose);
  } else {
    position.fail("has no position: add \"eye\":[x,y,z] or \"transform_matrix\"");
  }
  if (entry.contains("fov")) {
    const double degrees = parseNumber(entry["fov"], position.member("fov"));
    if (!(degrees > 0 && degrees < 180))
      position.member("fov").fail("must lie between 0 and 180 degrees");
    pose.fovY = degrees * collision::kRadiansPerDegree;
  }
  return pose;
}

/// Parses the horizontal field of view of Blender's exports, radians; nullopt if missing.
std::optional<double> parseFieldOfView(const Json& file, const JsonPosition& position) {
  if (!file.contains("camera_angle_x")) return std::nullopt;
  const double radians = parseNumber(file["camera_angle_x"], position.member("camera_angle_x"));
  if (!(radians > 0 && radians < std::numbers::pi))
    position.member("camera_angle_x").fail("must lie between 0 and pi radians");
  return radians;
}

/// Parses the lens; nullopt if missing. Distortion is refused, because renderers do not support it.
std::optional<PathLens> parseLens(const Json& file, const JsonPosition& position) {
  for (const char* key : {"k1", "k2", "k3", "k4", "p1", "p2"}) {
    if (file.contains(key) && parseNumber(file[key], position.member(key)) != 0)
      position.member(key).fail(
          "lens distortion is not supported; set it to 0, or undistort first");
  }
  const bool byAngle =
      !file.contains("fl_x") && parseFieldOfView(file, position) && file.contains("w");
  if (!file.contains("fl_x") && !byAngle) return std::nullopt;
  const auto number = [&](const char* key, std::optional<double> fallback) {
    if (file.contains(key)) return parseNumber(file[key], position.member(key));
    if (!fallback) position.fail(std::string(key) + " of the lens is missing");
    return *fallback;
  };
  PathLens lens;
  const double width = number("w", std::nullopt), height = number("h", std::nullopt);
  if (!(width >= 1 && width <= 1e6 && height >= 1 && height <= 1e6))
    position.member("w").fail("w and h must be pixels, at least 1");
  lens.width = static_cast<int>(width);
  lens.height = static_cast<int>(height);
  lens.pinhole.fx = byAngle ? width / 2 / std::tan(*parseFieldOfView(file, position) / 2)
                            : number("fl_x", std::nullopt);
  lens.pinhole.fy = number("fl_y", lens.pinhole.fx);
  lens.pinhole.cx = number("cx", width / 2);
  lens.pinhole.cy = number("cy", height / 2);
  if (!(lens.pinhole.fx > 0 && lens.pinhole.fy > 0))
    position.member("fl_x").fail("fl_x and fl_y must be above 0");
  return lens;
}

/// Parses the lens of a frame, if any; missing keys come from the file.
std::optional<PathLens> parseFrameLens(const Json& file, const Json& frame,
                                       const JsonPosition& position) {
  Json both = Json::object();
  for (const char* key :
       {"fl_x", "fl_y", "cx", "cy", "w", "h", "k1", "k2", "k3", "k4", "p1", "p2"}) {
    if (frame.contains(key)) both[key] = frame[key];
  }
  if (both.empty()) return std::nullopt;
  for (const char* key : {"fl_x", "fl_y", "cx", "cy", "w", "h"}) {
    if (!both.contains(key) && file.contains(key)) both[key] = file[key];
  }
  return parseLens(both, position);
}

}  // namespace

CameraPath parseJsonPath(std::string_view text, const std::string& source, CameraAxes axes,
                         double fps) {
  Json file;
  try {
    file = Json::parse(text);
  } catch (const Json::out_of_range&) {
    throw CameraPathError(source + ": a number exceeds the range of a double");
  } catch (const Json::parse_error& error) {
    throw CameraPathError(source + ": byte " + std::to_string(error.byte) +
                          ": is not JSON; a walk script's name ends in .jsonl");
  }
  const JsonPosition whole{source + ": "};
  const bool listed = file.is_array();
  if (!listed && !(file.is_object() && file.contains("frames") && file["frames"].is_array()))
    throw CameraPathError(source +
                          ": must be a list of poses, or an object with a list \"frames\" as in "
                          "transforms.json");
  CameraPath path;
  if (!listed) path.lens = parseLens(file, whole);
  if (!listed && !path.lens) path.fovX = parseFieldOfView(file, whole);
  const Json& entries = listed ? file : file["frames"];
  const JsonPosition list = listed ? JsonPosition{source + ": pose"} : whole.member("frames");
  if (entries.empty() || entries.size() > kMaxPoses)
    list.fail(std::to_string(entries.size()) + " poses; give 1 to 10,000,000");
  for (std::size_t i = 0; i < entries.size(); ++i) {
    const JsonPosition position = list.element(i);
    if (listed && entries[i].is_object()) requireKnownKeys(entries[i], position);
    path.poses.push_back(parsePose(entries[i], position, axes, static_cast<double>(i) / fps));
    if (!listed) path.poses.back().lens = parseFrameLens(file, entries[i], position);
    if (i > 0 && !(path.poses[i].time > path.poses[i - 1].time))
      position.member("time").fail("is not after the previous time; sort the poses by time");
  }
  return path;
}

}  // namespace enfilade::server
