// Fuzz target of camera paths: the first byte selects the format and the axes, the rest is the
// text.
#include "server/capture/path/json_path.hpp"
#include "server/capture/path/tum_path.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace enfilade::fuzz {

void tryBytes(std::span<const std::uint8_t> bytes) {
  if (bytes.empty()) return;
  const bool json = bytes[0] & 1;
  const auto axes = bytes[0] & 2 ? server::CameraAxes::opencv : server::CameraAxes::opengl;
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()) + 1, bytes.size() - 1);
  try {
    const server::CameraPath path = json ? server::parseJsonPath(text, "fuzz", axes, 30)
                                         : server::parseTumPath(text, "fuzz", axes);
    require(!path.poses.empty(), "a path has a pose");
    double last = -1e300;
    for (const server::CameraPose& pose : path.poses) {
      require(pose.time >= last, "times ascend");
      last = pose.time;
      require(pose.eye.allFinite(), "eye positions are finite");
      require((pose.rotation.transpose() * pose.rotation - server::Mat3::Identity()).norm() < 1e-6,
              "a camera is turned, and not bent");
    }
  } catch (const server::CameraPathError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
}

}  // namespace enfilade::fuzz
