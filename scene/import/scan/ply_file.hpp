// Reads PLY files: text, little-endian and big-endian. Private to the import.
#pragma once

#include <string_view>

#include "scene/import/scan/scan_mesh.hpp"

namespace enfilade::scene {

/// Parses a whole file. Each count of its header is compared with the bytes that follow before
/// anything is allocated for it. Throws ImportError without the file's name.
ScanMesh parsePly(std::string_view bytes);

}  // namespace enfilade::scene
