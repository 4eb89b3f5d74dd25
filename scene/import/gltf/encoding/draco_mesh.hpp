// Decodes meshes of KHR_draco_mesh_compression. Private to the import.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace enfilade::scene {

inline constexpr const char* kDracoExtension = "KHR_draco_mesh_compression";

/// An attribute to decode.
struct DracoAttribute {
  std::uint32_t id = 0;     ///< Draco's unique id
  std::size_t width = 3;    ///< components of an element
  bool normalised = false;  ///< by its accessor
};
using DracoAttributes = std::map<std::string, DracoAttribute>;  ///< by glTF's name

struct DracoMesh {
  std::vector<std::uint32_t> indices;  ///< three per triangle
  std::map<std::string, std::vector<float>> attributes;
};

/// Decodes into `mesh`. Returns "", or the reason why it failed. The counts in the header are
/// checked against the size of `bytes` before Draco allocates for them.
std::string decodeDracoMesh(std::string_view bytes, const DracoAttributes& wanted, DracoMesh& mesh);

}  // namespace enfilade::scene
