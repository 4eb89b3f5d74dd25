// Rebases OBJ files with map coordinates. assimp reads vertices as floats, so their common offset
// is subtracted from the text beforehand, in doubles.
#pragma once

#include <filesystem>
#include <string>

#include "collision/types.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// A file's text with `shift` subtracted from its coordinates. Empty text: no change was needed.
struct RebasedText {
  std::string text;
  Vec3 shift = Vec3::Zero();
};

/// Rebases an OBJ file if its median vertex is farther than `maxDistance` from the origin (both in
/// the file's units).
RebasedText rebaseObj(const std::filesystem::path& file, double maxDistance);

}  // namespace enfilade::scene
