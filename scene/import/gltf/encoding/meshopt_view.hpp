// Decodes buffer views of EXT_meshopt_compression and KHR_meshopt_compression. Private to the
// import.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// A compressed buffer view, with the extension's names of mode and filter.
struct MeshoptView {
  std::size_t count = 0, stride = 0;  ///< elements, bytes of each
  std::string mode, filter;
  std::string_view source;
};

/// Returns the extension's member of a buffer view; null if the view is not compressed.
const nlohmann::json* findMeshoptExtension(const nlohmann::json& view);

/// Decodes into `bytes`, `count` times `stride` of them. Returns "", or the reason why it failed.
std::string decodeMeshoptView(const MeshoptView& view, std::string& bytes);

}  // namespace enfilade::scene
