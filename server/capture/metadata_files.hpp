// Metadata files of a capture: instances, camera poses, and the manifest. The texts depend only on
// scene, path and options, so that all shards write the same files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

#include "scene/world/data/scene.hpp"
#include "server/capture/capture_frames.hpp"
#include "server/capture/capture_options.hpp"

namespace enfilade::server {

/// Maps ids to path, global_id, class, class_id, thing, operation and body; avatars have their
/// names.
std::string makeInstancesJson(const scene::Model& model, const std::vector<AvatarName>& avatars);

/// nerfstudio's format. The key "enfilade" describes axes, depth and other conventions.
std::string makeTransformsJson(const std::vector<CaptureFrame>& captureFrames,
                               const PictureOptions& options, const scene::Model& model);

/// `timestamp file` lines of rgb.txt and depth.txt. `channel` is the index in listFrameFiles().
std::string makeTumFileList(const std::vector<CaptureFrame>& captureFrames,
                            const PictureOptions& options, std::size_t channel,
                            const std::string& title);
/// `timestamp tx ty tz qx qy qz qw` lines with OpenCV camera axes, as in TUM's own files.
std::string makeTumGroundTruth(const std::vector<CaptureFrame>& captureFrames);

/// The inputs of the pictures. Captures may share a folder if their manifests are equal.
std::string makeManifest(const scene::Scene& scene, const std::filesystem::path& path,
                         const PictureOptions& options, const std::string& renderer);

/// Describes the keys in which two manifests differ, with both values; empty: equal.
std::string compareManifests(const std::string& one, const std::string& other);

}  // namespace enfilade::server
