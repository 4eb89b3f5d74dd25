// What lies beside a capture's frames: which ids are what, where each frame was taken from, and
// what the capture was made of. Texts that depend on scene, path and options alone, so that all
// shards write the same.
#pragma once

#include <string>

#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

/// id -> path, global_id, class, operation, body; of avatars their names.
std::string instancesJson(const scene::Model& model, const std::vector<WalkerName>& walkers);

/// nerfstudio's form; axes, depth and what else a reader must know stand under "enfilade".
std::string transformsJson(const std::vector<Shot>& shots, const PictureOptions& options,
                           const scene::Model& model);

/// `timestamp file` lines of rgb.txt and depth.txt; `channel` is 0 for the first of
/// filesOfFrame(), and so on.
std::string tumFileList(const std::vector<Shot>& shots, const PictureOptions& options,
                        std::size_t channel, const std::string& what);
/// `timestamp tx ty tz qx qy qz qw`; the camera's axes are OpenCV's, as TUM's own files have them.
std::string tumGroundTruth(const std::vector<Shot>& shots);

/// What the pictures are made of: two captures may share a folder when these are the same.
std::string manifestJson(const scene::Scene& scene, const std::filesystem::path& path,
                         const PictureOptions& options, const std::string& renderer);

/// The keys in which two manifests differ, with both values, for a person; empty: in none.
std::string manifestDifference(const std::string& one, const std::string& other);

}  // namespace enfilade::server
