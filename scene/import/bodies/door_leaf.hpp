// Splits a door's triangles into leaves and frame. Building files draw both as one product, but
// only the leaf moves.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// A door leaf in the door frame: that of its placement, metres, z up. If `hasSwappedAxes`, x and y
/// are swapped, so that x always runs along the width.
struct DoorLeaf {
  Aabb box;       ///< of all that moves with the leaf
  Aabb panel;     ///< of the panel that fills the opening: without handles
  int latch = 0;  ///< -1, 1: handle at the low or high end of x; 0: none found
};

/// Result of splitDoorTriangles().
struct DoorPieces {
  static constexpr std::uint8_t kFrame = 255;

  std::vector<DoorLeaf> leaves;  ///< ascending by x; empty: see `reason`
  std::string reason;
  bool hasSwappedAxes = false;  ///< the door's width runs along the placement's y
  /// For each triangle of the object's meshes, in order: its leaf, or kFrame.
  std::vector<std::uint8_t> pieceOfTriangle;
};

/// Splits an object that has a placement. A leaf is found only if connected surfaces fill the
/// middle of the door and the rest does not.
DoorPieces splitDoorTriangles(const Model& model, const Object& door);

}  // namespace enfilade::scene
