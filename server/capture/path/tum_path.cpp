#include "server/capture/path/tum_path.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "scene/model/trim.hpp"

namespace enfilade::server {
namespace {

constexpr double kUnitTolerance = 1e-2;  // tolerance of a quaternion's length

[[noreturn]] void throwPathError(const std::string& source, std::size_t line,
                                 const std::string& what) {
  throw CameraPathError(source + ":" + std::to_string(line) + ": " + what);
}

/// Parses eight finite numbers separated by blanks.
std::array<double, 8> parseNumbers(std::string_view line, const std::string& source,
                                   std::size_t number) {
  if (line.find(',') != std::string_view::npos)
    throwPathError(
        source, number,
        "commas: is it a table with another order? Write t tx ty tz qx qy qz qw with blanks "
        "between them, t in seconds (EuRoC has nanoseconds, and qw first)");
  std::array<double, 8> values{};
  std::size_t count = 0;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(std::min(line.find_first_not_of(" \t", end), line.size()));
    if (count == values.size())
      throwPathError(source, number, "more than eight numbers; write t tx ty tz qx qy qz qw");
    double value = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(value))
      throwPathError(source, number, "'" + std::string(word) + "' is not a finite number");
    values[count++] = value;
  }
  if (count < values.size())
    throwPathError(source, number,
                   std::to_string(count) + " numbers; write eight: t tx ty tz qx qy qz qw");
  return values;
}

CameraPose parsePose(const std::array<double, 8>& v, const std::string& source, std::size_t line,
                     CameraAxes axes) {
  const double length = std::hypot(std::hypot(v[4], v[5]), std::hypot(v[6], v[7]));
  if (!(std::abs(length - 1) <= kUnitTolerance))
    throwPathError(source, line,
                   "the quaternion's length is " + std::to_string(length) +
                       ", not 1; the order is qx qy qz qw");
  CameraPose pose;
  pose.time = v[0];
  pose.eye = Vec3(v[1], v[2], v[3]);
  if (!(pose.eye.cwiseAbs().maxCoeff() <= kMaxEyeCoordinate))
    throwPathError(source, line, "the position is farther than 1e9 m from the scene's origin");
  pose.rotation = convertAxes(toRotation({v[4], v[5], v[6], v[7]}), axes, CameraAxes::opengl);
  return pose;
}

}  // namespace

CameraPath parseTumPath(std::string_view text, const std::string& source, CameraAxes axes) {
  CameraPath path;
  std::size_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = scene::trim(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    if (path.poses.size() == kMaxPoses)
      throwPathError(source, number, "more than 10,000,000 poses; split the file");
    const CameraPose pose = parsePose(parseNumbers(line, source, number), source, number, axes);
    if (!path.poses.empty() && !(pose.time > path.poses.back().time))
      throwPathError(source, number,
                     "time " + std::to_string(pose.time) + " is not after " +
                         std::to_string(path.poses.back().time) + "; sort the lines by time");
    path.poses.push_back(pose);
  }
  if (path.poses.empty())
    throw CameraPathError(source + ": contains no pose; write lines t tx ty tz qx qy qz qw");
  return path;
}

}  // namespace enfilade::server
