// Which triangles of a door are its leaves, and which its frame. Files of buildings draw both as
// one product; a door that turned with its frame would stand in the wall.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// In the door's frame: that of its placement, metres, z up; if `turned` with x and y exchanged, so
/// that x always runs along the width and y through the wall.
struct DoorLeaf {
  Box box;        ///< of all that moves with it
  Box panel;      ///< of what fills the opening: `box` without handles
  int latch = 0;  ///< -1, 1: a handle sits towards x's low, high end; 0: none is found
};

struct DoorPieces {
  static constexpr std::uint8_t kFrame = 255;

  std::vector<DoorLeaf> leaves;  ///< by x, ascending; empty: `why` says why there are none
  std::string why;
  bool turned = false;  ///< the door's width runs along the placement's y
  /// Of each triangle of each mesh of the object, in their order: which leaf it is of, or kFrame.
  std::vector<std::uint8_t> pieceOfTriangle;
};

/// Of an object that has a placement. Leaves are found where connected surfaces fill the middle of
/// the door and the rest does not; nothing is guessed.
DoorPieces piecesOfDoor(const Model& model, const Object& door);

}  // namespace enfilade::scene
