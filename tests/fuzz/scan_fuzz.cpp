// Fuzz target of PLY and STL files. Input that begins with "ply" is a PLY file, all else an STL
// file.
#include <string_view>

#include "scene/import/file/import_options.hpp"
#include "scene/import/scan/guess_up_axis.hpp"
#include "scene/import/scan/ply_file.hpp"
#include "scene/import/scan/stl_file.hpp"
#include "tests/fuzz/fuzz_target.hpp"

namespace enfilade::fuzz {
namespace {

void requireValidMesh(const scene::ScanMesh& mesh) {
  require(mesh.indices.size() % 3 == 0, "triangles have three corners");
  require(mesh.normals.empty() || mesh.normals.size() == mesh.positions.size(),
          "each vertex has a normal");
  require(mesh.colours.empty() || mesh.colours.size() == mesh.positions.size(),
          "each vertex has a colour");
  for (const std::uint32_t i : mesh.indices) {
    require(i < mesh.positions.size(), "indices are in range");
    require(mesh.positions[i].allFinite(), "used vertices are finite");
  }
}

}  // namespace

void tryBytes(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  std::vector<scene::ScanMesh> meshes;
  try {
    if (text.starts_with("ply")) {
      meshes.push_back(scene::parsePly(text));
    } else {
      meshes = scene::parseStl(text);
    }
  } catch (const scene::ImportError& error) {
    require(error.what()[0] != '\0', "an error has a message");
  }
  for (const scene::ScanMesh& mesh : meshes) requireValidMesh(mesh);
  const scene::UpAxis up = scene::guessUpAxis(scene::computeLevelAreas(meshes)).axis;
  require(up <= scene::UpAxis::z, "the up axis is an axis");
}

}  // namespace enfilade::fuzz
