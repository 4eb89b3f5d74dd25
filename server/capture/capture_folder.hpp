// The folder of a capture: one capture a folder, told by its manifest, so that a run can go on
// where another one stopped and shards can meet.
#pragma once

#include <filesystem>
#include <string>

#include "server/capture/capture_plan.hpp"

namespace enfilade::server {

inline constexpr const char* kManifest = "capture.json";

/// Makes the folder and proves that it can be written; throws std::runtime_error, naming it.
void prepareFolder(const std::filesystem::path& folder);

/// Claims the folder for this manifest: it holds no frames yet, or some of the same capture.
/// Removes what a killed run left half written. Throws std::runtime_error, with the remedy, for a
/// folder that holds something else.
void claimFolder(const std::filesystem::path& folder, const PictureOptions& options,
                 const std::string& manifest);

/// A capture failed: a folder without a single finished frame is free for any other.
void disclaimFolder(const std::filesystem::path& folder);

/// instances.json, transforms.json, and the lists of the TUM layout.
void writeDocuments(const std::filesystem::path& folder, const scene::Scene& scene,
                    const ShotList& list, const PictureOptions& options);

}  // namespace enfilade::server
