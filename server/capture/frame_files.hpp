// The files of one frame of a capture.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "render/image/image.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// One picture's files, relative to the capture's folder, as rgb/000012.png; the order is rgb,
/// depth, ids, normals, range, overlay.
std::vector<std::filesystem::path> filesOfFrame(const PictureOptions& options, std::size_t index);

/// The folders that the files lie in, relative to the capture's.
std::vector<std::filesystem::path> foldersOf(const PictureOptions& options);

/// Whether every file of the frame is there. They appear whole, so that a file there is a whole
/// one.
bool isThere(const std::filesystem::path& folder, const PictureOptions& options, std::size_t index);

/// What had to be bent to fit into the files.
struct FrameFaults {
  std::size_t clamped = 0;  ///< pixels of depth or range beyond what 16 bits hold
};

/// The frame's colour with marks on it.
using DrawOverlay = std::function<render::Image(const render::Frame& frame)>;

/// Encodes the frame and writes its files, each whole. Throws std::runtime_error naming the file:
/// also where depth or ids do not fit into 16 bits.
FrameFaults writeFrame(const std::filesystem::path& folder, const PictureOptions& options,
                       std::size_t index, const render::Frame& frame, const DrawOverlay& overlay);

}  // namespace enfilade::server
