#include "server/capture/frame_files.hpp"

#include <cstdio>
#include <stdexcept>
#include <string>

#include "render/image/atomic_file.hpp"
#include "render/image/depth_noise.hpp"
#include "render/image/encode.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;
using render::Bytes;
using render::Raster;

constexpr std::uint32_t kMaxId16 = 65535;

struct ChannelFile {
  const char* folder;
  const char* extension;
};

const char* getDepthExtension(DepthFile depth) {
  if (depth == DepthFile::png) return ".png";
  return depth == DepthFile::zst ? ".zst" : ".npy";
}

std::vector<ChannelFile> listChannels(const PictureOptions& options) {
  const CaptureChannels& wanted = options.channels;
  std::vector<ChannelFile> files;
  if (wanted.rgb) files.push_back({"rgb", options.rgb == RgbFile::jpeg ? ".jpg" : ".png"});
  if (wanted.depth) files.push_back({"depth", getDepthExtension(options.depth)});
  if (wanted.ids) files.push_back({"ids", options.ids == IdsFile::png ? ".png" : ".npy"});
  if (wanted.normals) files.push_back({"normals", ".npy"});
  if (wanted.range) files.push_back({"range", getDepthExtension(options.depth)});
  const char* idExtension = options.ids == IdsFile::png ? ".png" : ".npy";
  if (wanted.classes) files.push_back({"class", idExtension});
  if (wanted.things) files.push_back({"thing", idExtension});
  if (options.overlay.any()) files.push_back({"overlay", ".png"});
  return files;
}

template <class Value>
Raster<Value> makeRaster(const render::Frame& frame, int channels,
                         const std::vector<Value>& values) {
  return {frame.camera.width, frame.camera.height, channels, values};
}

Bytes encodeRgb(const render::Frame& frame, const PictureOptions& options) {
  const auto pixels = makeRaster(frame, 3, frame.rgb);
  return options.rgb == RgbFile::jpeg ? render::encodeJpeg(pixels, options.quality)
                                      : render::encodePng(pixels);
}

/// Encodes depth, or range, which has the same format.
Bytes encodeDepth(const render::Frame& frame, const std::vector<float>& metres,
                  const PictureOptions& options, FrameFaults& faults) {
  if (options.depth == DepthFile::npy) return render::encodeNpy(makeRaster(frame, 1, metres));
  const render::Depth16 depth = render::quantizeDepth(metres, options.depthStepsPerMetre);
  if (depth.clampedPixels > 0 && options.tooFar == TooFar::refuse) {
    char farthest[32];
    std::snprintf(farthest, sizeof farthest, "%g", kMaxId16 / options.depthStepsPerMetre);
    throw std::runtime_error(std::to_string(depth.clampedPixels) + " pixels are farther than the " +
                             farthest +
                             " m that fit into 16 bits; give a smaller --depth-scale, --depth "
                             "npy, or "
                             "--too-far clamp");
  }
  faults.clamped += depth.clampedPixels;
  const auto steps = makeRaster(frame, 1, depth.steps);
  return options.depth == DepthFile::png ? render::encodePng(steps) : render::packDepth(steps);
}

/// Encodes ids, or class and thing ids, which have the same format.
Bytes encodeIds(const render::Frame& frame, const std::vector<std::uint32_t>& ids,
                const PictureOptions& options) {
  if (options.ids == IdsFile::npy) return render::encodeNpy(makeRaster(frame, 1, ids));
  std::vector<std::uint16_t> narrow;
  narrow.reserve(ids.size());
  for (const std::uint32_t id : ids) {
    if (id > kMaxId16)
      throw std::runtime_error("id " + std::to_string(id) +
                               " does not fit into 16 bits; give --ids npy");
    narrow.push_back(static_cast<std::uint16_t>(id));
  }
  return render::encodePng(makeRaster(frame, 1, narrow));
}

/// The depth of frame `index`. Its noise depends on the index, so it is the same in each shard.
std::vector<float> measureDepth(const render::Frame& frame, const PictureOptions& options,
                                std::size_t index) {
  std::vector<float> depth = frame.depth;
  if (options.depthNoise)
    render::addDepthNoise(depth, frame.camera.width, frame.camera.height, {*options.depthNoise},
                          index);
  return depth;
}

Bytes encodeChannel(const std::string& channel, std::size_t index, const render::Frame& frame,
                    const PictureOptions& options, const scene::ObjectClasses& classes,
                    const DrawOverlay& overlay, FrameFaults& faults) {
  if (channel == "overlay") return render::encodePng(overlay(frame));
  if (channel == "rgb") return encodeRgb(frame, options);
  if (channel == "depth") {
    return encodeDepth(frame, measureDepth(frame, options, index), options, faults);
  }
  if (channel == "ids") return encodeIds(frame, frame.ids, options);
  if (channel == "class") return encodeIds(frame, classes.getClasses(frame.ids), options);
  if (channel == "thing") return encodeIds(frame, classes.getThings(frame.ids), options);
  if (channel == "normals") return render::encodeNpy(makeRaster(frame, 3, frame.normals));
  return encodeDepth(frame, render::computeRange(frame), options, faults);
}

fs::path makeFilePath(const ChannelFile& channel, std::size_t index) {
  char name[32];
  std::snprintf(name, sizeof name, "%06zu", index);
  return fs::path(channel.folder) / (std::string(name) + channel.extension);
}

}  // namespace

std::vector<fs::path> listFrameFiles(const PictureOptions& options, std::size_t index) {
  std::vector<fs::path> files;
  for (const ChannelFile& channel : listChannels(options))
    files.push_back(makeFilePath(channel, index));
  return files;
}

std::vector<fs::path> listFrameFolders(const PictureOptions& options) {
  std::vector<fs::path> folders;
  for (const ChannelFile& channel : listChannels(options)) folders.emplace_back(channel.folder);
  return folders;
}

bool isFrameComplete(const fs::path& folder, const PictureOptions& options, std::size_t index) {
  for (const fs::path& file : listFrameFiles(options, index)) {
    std::error_code error;
    if (!fs::is_regular_file(folder / file, error)) return false;
  }
  return true;
}

FrameFaults writeFrame(const fs::path& folder, const PictureOptions& options, std::size_t index,
                       const render::Frame& frame, const scene::ObjectClasses& classes,
                       const DrawOverlay& overlay) {
  FrameFaults faults;
  for (const ChannelFile& channel : listChannels(options)) {
    const fs::path file = folder / makeFilePath(channel, index);
    Bytes bytes;
    try {
      bytes = encodeChannel(channel.folder, index, frame, options, classes, overlay, faults);
    } catch (const std::runtime_error& error) {
      throw std::runtime_error(file.string() + ": " + error.what());
    }
    render::writeFileAtomically(file, bytes.data(), bytes.size());
  }
  return faults;
}

}  // namespace enfilade::server
