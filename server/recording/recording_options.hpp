// Options of a recording: contents and file.
#pragma once

#include <filesystem>
#include <optional>

#include "server/base/load_scene.hpp"

namespace enfilade::server {

/// The recording to write.
struct RecordingChoice {
  std::filesystem::path file;  ///< empty: none
  bool forViewers = false;     ///< also write the channels for Foxglove and Lichtblick
  /// Interval of avatar views, in seconds of simulated time; 0: only frames that clients request.
  /// Implies `forViewers`.
  std::optional<double> pictureInterval;
};

struct RecordingOptions {
  RecordingChoice choice;
  ModelOptions model;     ///< how the scene was imported
  bool overwrite = true;  ///< overwrites an existing file; otherwise that is an error
};

}  // namespace enfilade::server
