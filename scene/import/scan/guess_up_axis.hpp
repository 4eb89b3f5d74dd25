// Guesses the up axis of scans and printed parts, whose files do not state it.
#pragma once

#include <array>
#include <span>

#include "scene/import/scan/scan_mesh.hpp"
#include "scene/model/up_axis.hpp"

namespace enfilade::scene {

/// The triangles within 10 degrees of perpendicular to an axis; areas in square units of the file.
struct LevelArea {
  double largest = 0;  ///< of those at one height
  double all = 0;
  /// That at one height is in the upper half and faces down, and the lower half has no such level.
  /// This is a floor that hangs upside down, or a ceiling alone.
  bool hangs = false;
};

struct LevelAreas {
  std::array<LevelArea, 3> axes;  ///< x, y, z
  double surface = 0;             ///< of all triangles
};

LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes);

struct UpAxisGuess {
  UpAxis axis = UpAxis::z;
  /// Its level exceeds those of the other axes by half and does not hang. The level areas are a
  /// tenth of the surface, and those of a second axis a twentieth, as in a room with square walls.
  /// In a tilted one, only two walls are perpendicular to an axis. Of a lawn or a table, three
  /// quarters of the surface are level, and no second axis is needed.
  bool isClear = false;
};

/// The axis with the largest level: a floor lies at one height and exceeds each single wall of most
/// rooms. z, which scanners and printers prefer, unless another axis has a twentieth more.
UpAxisGuess guessUpAxis(const LevelAreas& areas);

}  // namespace enfilade::scene
