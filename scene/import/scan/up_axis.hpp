// Guesses the up axis of scans and printed parts, whose files do not state it.
#pragma once

#include <array>
#include <span>

#include "scene/import/scan/scan_mesh.hpp"

namespace enfilade::scene {

/// For each axis, the area of the triangles that lie within 10 degrees of perpendicular to it, in
/// square units of the file.
using LevelAreas = std::array<double, 3>;
LevelAreas computeLevelAreas(std::span<const ScanMesh> meshes);

/// The axis with the largest such area, because floors, ceilings and tables together exceed the
/// walls of each direction in most rooms. 'z', which scanners and printers prefer, unless another
/// axis has a twentieth more.
char guessUpAxis(const LevelAreas& areas);

}  // namespace enfilade::scene
