#include "server/capture/path/camera_path.hpp"

#include <array>
#include <charconv>
#include <cmath>

#include "render/camera_basis.hpp"

namespace enfilade::server {
namespace {

constexpr double kUnit = 1e-2;     // a quaternion's length may be off by so much
constexpr double kFarthest = 1e9;  // metres, as render/camera.cpp takes
constexpr std::size_t kMostPoses = 10'000'000;

[[noreturn]] void refuse(const std::string& source, std::size_t line, const std::string& what) {
  throw CameraPathError(source + ":" + std::to_string(line) + ": " + what);
}

std::string_view trimmed(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r";
  const std::size_t first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

/// Eight finite numbers apart by blanks.
std::array<double, 8> numbersOf(std::string_view line, const std::string& source,
                                std::size_t number) {
  if (line.find(',') != std::string_view::npos)
    refuse(source, number,
           "commas: is it a table of another order? Write t tx ty tz qx qy qz qw with blanks "
           "between them, t in seconds (EuRoC has nanoseconds, and qw first)");
  std::array<double, 8> values{};
  std::size_t count = 0;
  while (!line.empty()) {
    const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
    const std::string_view word = line.substr(0, end);
    line.remove_prefix(std::min(line.find_first_not_of(" \t", end), line.size()));
    if (count == values.size())
      refuse(source, number, "more than eight numbers; write t tx ty tz qx qy qz qw");
    double value = 0;
    const auto read = std::from_chars(word.data(), word.data() + word.size(), value);
    if (read.ec != std::errc() || read.ptr != word.data() + word.size() || !std::isfinite(value))
      refuse(source, number, "'" + std::string(word) + "' is no finite number");
    values[count++] = value;
  }
  if (count < values.size())
    refuse(source, number, std::to_string(count) + " numbers; write eight: t tx ty tz qx qy qz qw");
  return values;
}

CameraPose poseOf(const std::array<double, 8>& v, const std::string& source, std::size_t line,
                  CameraAxes axes) {
  const double length = std::hypot(std::hypot(v[4], v[5]), std::hypot(v[6], v[7]));
  if (!(std::abs(length - 1) <= kUnit))
    refuse(source, line,
           "the quaternion's length is " + std::to_string(length) +
               ", not 1; the order is qx qy qz qw");
  CameraPose pose;
  pose.time = v[0];
  pose.eye = Vec3(v[1], v[2], v[3]);
  if (!(pose.eye.cwiseAbs().maxCoeff() <= kFarthest))
    refuse(source, line, "the place is farther than 1e9 m from the scene's origin");
  pose.turned = withAxes(rotationOf({v[4], v[5], v[6], v[7]}), axes, CameraAxes::opengl);
  return pose;
}

}  // namespace

Mat3 rotationOf(const std::array<double, 4>& xyzw) {
  return Eigen::Quaterniond(xyzw[3], xyzw[0], xyzw[1], xyzw[2]).normalized().toRotationMatrix();
}

std::array<double, 4> quaternionOf(const Mat3& rotation) {
  Eigen::Quaterniond q(rotation);
  q.normalize();
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  return {q.x(), q.y(), q.z(), q.w()};
}

Mat3 turnedOf(const render::Camera& camera) {
  const render::View view = render::viewOf(camera);
  Mat3 turned;
  turned << view.right, view.up, -view.forward;
  return turned;
}

Mat3 withAxes(const Mat3& turned, CameraAxes from, CameraAxes to) {
  if (from == to) return turned;
  Mat3 other = turned;
  other.col(1) = -turned.col(1);
  other.col(2) = -turned.col(2);
  return other;
}

CameraPath parseTumPath(std::string_view text, const std::string& source, CameraAxes axes) {
  CameraPath path;
  std::size_t number = 0;
  while (!text.empty()) {
    ++number;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    line = trimmed(line.substr(0, line.find('#')));
    if (line.empty()) continue;
    if (path.poses.size() == kMostPoses)
      refuse(source, number, "more than 10,000,000 poses; split the file");
    const CameraPose pose = poseOf(numbersOf(line, source, number), source, number, axes);
    if (!path.poses.empty() && !(pose.time > path.poses.back().time))
      refuse(source, number,
             "time " + std::to_string(pose.time) + " does not come after " +
                 std::to_string(path.poses.back().time) + "; sort the lines by time");
    path.poses.push_back(pose);
  }
  if (path.poses.empty())
    throw CameraPathError(source + ": holds no pose; write lines t tx ty tz qx qy qz qw");
  return path;
}

}  // namespace enfilade::server
