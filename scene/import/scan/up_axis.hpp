// Guesses the up axis of scans and printed parts, whose files do not state it.
#pragma once

#include <array>
#include <span>

#include "scene/import/scan/scan_mesh.hpp"

namespace enfilade::scene {

/// For each axis, the area of the triangles that lie within 10 degrees of perpendicular to it and
/// at one height: the largest such level, in square units of the file.
using LevelAreas = std::array<double, 3>;
LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes);

struct UpAxisGuess {
  char axis;
  bool isClear;  ///< its level exceeds those of the other axes by half
};

/// The axis with the largest level: a floor lies at one height and exceeds each single wall of most
/// rooms. 'z', which scanners and printers prefer, unless another axis has a twentieth more.
UpAxisGuess guessUpAxis(const LevelAreas& areas);

}  // namespace enfilade::scene
