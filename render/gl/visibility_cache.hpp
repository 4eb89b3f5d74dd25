// What earlier pictures showed, by where they were taken from: the first guess for the next one.
#pragma once

#include <cstdint>
#include <vector>

#include "render/camera.hpp"

namespace enfilade::render {

struct Seen {
  Camera camera;
  std::vector<std::uint32_t> parts;      ///< may have been seen; ascending
  std::vector<scene::EntityId> avatars;  ///< likewise
  std::uint64_t used = 0;                ///< picture number of the last use; 0: never
};

/// Nothing in a picture depends on it, only how long it takes. Many cameras in one tick each find
/// their own entry, or that of a neighbour.
class SeenMemory {
 public:
  /// What was seen from nearest by, to be updated for `camera`; empty (used = 0) when that lies too
  /// far off to be of use. Valid until the next call.
  Seen& recall(const Camera& camera, std::uint64_t picture);
  /// The same, to look at; null when there is none.
  const Seen* find(const Camera& camera) const;

 private:
  std::vector<Seen> entries_;
};

}  // namespace enfilade::render
