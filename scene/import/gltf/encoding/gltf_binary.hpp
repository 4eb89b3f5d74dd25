// The buffer, views and accessors of a glTF file that is being written. Private to the import.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>

namespace enfilade::scene {

/// The header and the JSON of a GLB file whose binary chunk of `rest` bytes, its header included,
/// follows. "" if the file exceeds the four gigabytes of a GLB file.
std::string makeGlbStart(std::string json, std::size_t rest);

class GltfBinary {
 public:
  /// Each returns the index of the new accessor or view.
  std::size_t addFloats(std::span<const float> values, std::size_t width);
  std::size_t addIndices(std::span<const std::uint32_t> values);
  std::size_t addView(std::string_view bytes);

  /// Replaces the file's accessors, views and buffers.
  void install(nlohmann::json& gltf);
  /// The file with this JSON; "" if it exceeds the four gigabytes of a GLB file.
  std::string makeGlb(std::string json) const;

 private:
  std::size_t addAccessor(std::size_t count, int componentType, const char* type,
                          std::string_view bytes);

  nlohmann::json accessors_ = nlohmann::json::array(), views_ = nlohmann::json::array();
  std::string bytes_;
};

}  // namespace enfilade::scene
