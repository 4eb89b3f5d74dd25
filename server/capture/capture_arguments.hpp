// The options of `enfilade capture`, as CLI11 leaves them and as the capture takes them.
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
  std::string rgb = "png", quality = "95", depth = "npy", depthScale, tooFar = "refuse";
  std::string ids = "npy", layout = "plain", axes = "opengl", fps = "30", every = "0", avatar;
  std::string camera, shard = "0/1", limit = "0", progress = "bar", glass = "clear",
                      renderer = "auto", overlay;
  bool still = false, strict = false, noMp4 = false, dryRun = false, reportDepth = false,
       shadows = false;
};

/// PATH and the options, each checked as it is read. `into` lives as long as `verb`.
void addCapture(CLI::App& verb, CaptureArguments& into);

PictureOptions picturesFrom(const CaptureArguments& read);
CaptureRunOptions captureRunFrom(const CaptureArguments& read);

}  // namespace enfilade::server
