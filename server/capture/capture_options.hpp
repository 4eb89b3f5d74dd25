// Options of a capture, plain data from its command line.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "render/renderer_kind.hpp"
#include "server/capture/path/camera_path.hpp"

namespace enfilade::server {

enum class RgbFile : std::uint8_t { png, jpeg };
enum class DepthFile : std::uint8_t {
  npy,  ///< float32 metres; NaN: no surface
  png,  ///< 16-bit steps; 0: no surface
  zst   ///< format of render::packDepth()
};
enum class IdsFile : std::uint8_t { npy, png };
enum class FolderLayout : std::uint8_t {
  plain,
  tum  ///< adds rgb.txt, depth.txt, groundtruth.txt
};
enum class TooFar : std::uint8_t { refuse, clamp };
enum class ProgressFormat : std::uint8_t { bar, json };

struct CaptureChannels {
  bool rgb = true, depth = true, ids = true, normals = false, range = false;
  bool classes = false, things = false;
};

/// Marks that are drawn on a copy of the colour.
struct OverlayChoice {
  bool contacts = false, boxes = false, names = false, paths = false;
  bool any() const { return contacts || boxes || names || paths; }
};

/// Every `count`-th frame starting at `index`, 0 <= index < count.
struct Shard {
  std::uint32_t index = 0, count = 1;
};

/// True if frame `index` belongs to the shard.
inline bool isInShard(const Shard& shard, std::size_t index) {
  return index % shard.count == shard.index;
}

/// All options that affect the pictures.
struct PictureOptions {
  std::optional<int> width, height;  ///< pixels, both or none; default: the path's, else 640 x 480
  std::optional<double> fovY;        ///< radians; overrides the path
  std::optional<render::Pinhole> pinhole;  ///< overrides fovY
  double near = 0.05, far = 1000;          ///< metres
  CameraAxes axes = CameraAxes::opengl;    ///< axes of the path's rotations
  double fps = 30;                         ///< for paths without times and for glTF animations
  std::uint32_t every = 0;                 ///< script: ticks; 0: the script's captures
  std::string avatar;                      ///< with `every`: the viewing avatar; "": the first
  std::string camera;                      ///< glTF camera name; "": the first
  bool freezeScene = false;                ///< camera paths: bodies keep their initial poses
  std::uint64_t limit = 0;                 ///< maximum number of frames; 0: all
  CaptureChannels channels;
  RgbFile rgb = RgbFile::png;
  int quality = 95;  ///< JPEG quality
  DepthFile depth = DepthFile::npy;
  double depthStepsPerMetre = 1000;  ///< for DepthFile::png and zst
  TooFar tooFar = TooFar::refuse;
  /// Seed of render::addDepthNoise() for the channel depth; nullopt: no noise.
  std::optional<std::uint64_t> depthNoise;
  IdsFile ids = IdsFile::npy;
  FolderLayout layout = FolderLayout::plain;
  OverlayChoice overlay;
  render::RendererKind renderer = render::RendererKind::automatic;
  render::TransparencyMode glass = render::TransparencyMode::blend;
  render::AvatarForm avatars = render::AvatarForm::figure;
  bool shadows = true;
  std::uint32_t samples = 1;  ///< of the colour in each pixel
};

/// Options of the run that do not affect the pictures.
struct CaptureRunOptions {
  Shard shard;
  bool mp4 = true;  ///< make a video when all frames exist
  bool dryRun = false;
  bool strict = false;       ///< failed orders and blank frames are violations
  bool reportDepth = false;  ///< compare each frame with ray-traced ground truth
  ProgressFormat progress = ProgressFormat::bar;
};

}  // namespace enfilade::server
