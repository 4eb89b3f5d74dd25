// Reads STL files, text and binary. Private to the import.
#pragma once

#include <string_view>
#include <vector>

#include "scene/import/scan/scan_mesh.hpp"

namespace enfilade::scene {

/// Parses a whole file: one mesh per solid, with equal corners joined. The number of triangles of a
/// binary file is compared with its size before anything is allocated. Throws ImportError without
/// the file's name.
std::vector<ScanMesh> parseStl(std::string_view bytes);

}  // namespace enfilade::scene
