// Names and contents of the files of one captured frame.
#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "render/image/image.hpp"
#include "scene/model/object_classes.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Files of one frame, relative to the capture folder, for example rgb/000012.png. Order: rgb,
/// depth, ids, normals, range, class, thing, overlay.
std::vector<std::filesystem::path> listFrameFiles(const PictureOptions& options, std::size_t index);

/// Folders of the files, relative to the capture folder.
std::vector<std::filesystem::path> listFrameFolders(const PictureOptions& options);

/// True if all files of the frame exist. Files are written atomically, so that existing files are
/// complete.
bool isFrameComplete(const std::filesystem::path& folder, const PictureOptions& options,
                     std::size_t index);

/// Values that did not fit into the file formats.
struct FrameFaults {
  std::size_t clamped = 0;  ///< pixels of depth or range beyond 16 bits
};

/// Draws marks on the frame's colour.
using DrawOverlay = std::function<render::Image(const render::Frame& frame)>;

/// Encodes the frame and writes its files atomically. Throws std::runtime_error with the file name,
/// also if depth, ids, classes or things do not fit into 16 bits.
FrameFaults writeFrame(const std::filesystem::path& folder, const PictureOptions& options,
                       std::size_t index, const render::Frame& frame,
                       const scene::ObjectClasses& classes, const DrawOverlay& overlay);

}  // namespace enfilade::server
