// A plan of the scene, a picture a storey, with what happened in a walk drawn on it.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "render/image.hpp"

namespace enfilade::server {

using collision::Vec3;

/// Where an avatar's feet were, tick by tick; scene frame, metres.
struct WalkedPath {
  std::string avatar;
  std::vector<Vec3> feet;
};
struct MapContact {
  Vec3 point = Vec3::Zero();
  Vec3 normal = Vec3::UnitY();
};
struct MapCapture {
  std::string name;
  Vec3 eye = Vec3::Zero();
  Vec3 gaze = Vec3::UnitX();
};

struct WalkTrace {
  std::string title;
  std::vector<WalkedPath> paths;
  std::vector<MapContact> contacts;  ///< that began
  std::vector<MapContact> stops;     ///< where a walk ended blocked
  std::vector<MapCapture> captures;
};

/// Heights of the floors that were walked on for long, ascending; empty when nobody walked.
std::vector<double> walkedStoreys(const std::vector<WalkedPath>& paths);

/// A plan as it was drawn, with the ids of what is seen, pixel by pixel.
struct PlanPicture {
  render::Image colour;
  std::vector<std::uint32_t> ids;
};

/// Takes the picture that a camera asks for; nullopt when there is none to be had.
using TakePicture = std::function<std::optional<PlanPicture>(const render::Camera&)>;

/// nullopt when there is nothing to draw or no picture to draw on.
std::optional<render::Image> drawMap(const WalkTrace& trace, const TakePicture& picture);

}  // namespace enfilade::server
