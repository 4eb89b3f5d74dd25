// What a capture is asked for: plain data of its command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "render/service/renderer.hpp"
#include "server/capture/path/camera_path.hpp"

namespace enfilade::server {

enum class RgbFile : std::uint8_t { png, jpeg };
enum class DepthFile : std::uint8_t {
  npy,  ///< float32 metres, not a number: nothing
  png,  ///< 16 bit steps, 0: nothing
  zst   ///< as render::packDepth()
};
enum class IdsFile : std::uint8_t { npy, png };
enum class FolderLayout : std::uint8_t {
  plain,
  tum  ///< the same files, and rgb.txt, depth.txt, groundtruth.txt beside them
};
enum class TooFar : std::uint8_t { refuse, clamp };
enum class CaptureProgress : std::uint8_t { bar, json };

struct CaptureChannels {
  bool rgb = true, depth = true, ids = true, normals = false, range = false;
};

/// What is drawn for people on a copy of the colour.
struct OverlayChoice {
  bool contacts = false, boxes = false, names = false, paths = false;
  bool any() const { return contacts || boxes || names || paths; }
};

/// Every `count`-th frame from `index` on, 0 <= index < count.
struct Shard {
  std::uint32_t index = 0, count = 1;
};

/// Everything that pictures depend on, besides the scene and the path.
struct PictureOptions {
  std::optional<int> width, height;  ///< pixels, both or neither; else the path's, else 640 x 480
  std::optional<double> fovY;        ///< radians; before what the path says
  std::optional<render::Pinhole> pinhole;  ///< before fovY
  double near = 0.05, far = 1000;          ///< metres
  CameraAxes axes = CameraAxes::opengl;    ///< of the path's rotations
  double fps = 30;                         ///< of paths without times, and of glTF's animations
  std::uint32_t every = 0;                 ///< walk: ticks; 0: the script's captures
  std::string avatar;                      ///< walk with `every`: whose eyes; "": the first one's
  std::string camera;                      ///< glTF: the camera's name; "": the first one
  bool still = false;                      ///< camera paths: the world stands as it begins
  std::uint64_t limit = 0;                 ///< frames from the beginning; 0: all
  CaptureChannels channels;
  RgbFile rgb = RgbFile::png;
  int quality = 95;  ///< of JPEG
  DepthFile depth = DepthFile::npy;
  double depthSteps = 1000;  ///< a metre, of DepthFile::png and zst
  TooFar tooFar = TooFar::refuse;
  IdsFile ids = IdsFile::npy;
  FolderLayout layout = FolderLayout::plain;
  OverlayChoice overlay;
  render::RendererKind renderer = render::RendererKind::automatic;
  render::Glass glass = render::Glass::clear;
  bool shadows = false;
};

/// How the work is done; pictures do not depend on it.
struct CaptureRunOptions {
  Shard shard;
  bool mp4 = true;  ///< when all frames are there, and ffmpeg
  bool dryRun = false;
  bool strict = false;       ///< a script that goes wrong, or a blind frame, is a violation
  bool reportDepth = false;  ///< each frame drawn is compared with rays in doubles
  CaptureProgress progress = CaptureProgress::bar;
};

}  // namespace enfilade::server
