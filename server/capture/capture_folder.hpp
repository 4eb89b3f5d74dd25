// The folder of one capture, identified by its manifest, so that runs can resume and shards can
// share the folder.
#pragma once

#include <filesystem>
#include <string>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

inline constexpr const char* kManifestName = "capture.json";

/// Claims the folder for this manifest: it must be empty or contain frames of the same capture.
/// Removes partial files of killed runs. Throws std::runtime_error with a remedy for a folder with
/// other files.
void claimFolder(const std::filesystem::path& folder, const PictureOptions& options,
                 const std::string& manifest);

/// Releases the folder of a failed capture if it contains no complete frame.
void releaseFolder(const std::filesystem::path& folder);

/// Writes instances.json, transforms.json, and the lists of the TUM layout.
void writeMetadataFiles(const std::filesystem::path& folder, const scene::Scene& scene,
                        const CapturePlan& plan, const PictureOptions& options);

}  // namespace enfilade::server
