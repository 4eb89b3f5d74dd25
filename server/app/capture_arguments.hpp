// The options of `enfilade capture`: as texts from CLI11, and converted.
#pragma once

#include <string>

#include "server/capture/capture_options.hpp"

namespace CLI {
class App;
}

namespace enfilade::server {

struct CaptureArguments {
  std::string path, out;
  std::string size, fov, intrinsics, near = "0.05", far = "1000", channels = "rgb,depth,ids";
  std::string rgb = "png", quality = "95", depth = "npy", depthScale, tooFar = "refuse", depthNoise;
  std::string ids = "npy", layout = "plain", axes = "opengl", fps = "30", every = "0", avatar;
  std::string camera, shard = "0/1", limit = "0", progress = "bar", glass = "clear",
                      renderer = "auto", overlay, avatars = "people", samples = "1";
  bool still = false, strict = false, noMp4 = false, dryRun = false, reportDepth = false,
       noShadows = false;
};

/// Validates the name of an output folder. Returns the error, or an empty text.
std::string validateFolder(const std::string& text);

/// Adds PATH and the options with their validators. `into` must outlive `verb`.
void addCaptureOptions(CLI::App& verb, CaptureArguments& into);

PictureOptions makePictureOptions(const CaptureArguments& read);
CaptureRunOptions makeCaptureRunOptions(const CaptureArguments& read);

}  // namespace enfilade::server
