#include "scene/import/gltf/encoding/gltf_binary.hpp"

#include <array>
#include <utility>

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

/// Appends a number of 32 bits, little-endian.
void appendGlbWord(std::string& to, std::size_t value) {
  for (unsigned shift = 0; shift < 32; shift += 8) to += static_cast<char>(value >> shift & 255U);
}

}  // namespace

std::size_t GltfBinary::addView(std::string_view bytes) {
  bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
  views_.push_back({{"buffer", 0u}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}});
  bytes_.append(bytes);
  return views_.size() - 1;
}

std::size_t GltfBinary::addAccessor(std::size_t count, int componentType, const char* type,
                                    std::string_view bytes) {
  const std::size_t view = addView(bytes);
  accessors_.push_back(
      {{"bufferView", view}, {"componentType", componentType}, {"count", count}, {"type", type}});
  return accessors_.size() - 1;
}

std::size_t GltfBinary::addFloats(std::span<const float> values, std::size_t width) {
  static constexpr std::array<const char*, 5> kTypes{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  return addAccessor(values.size() / width, 5126, kTypes.at(width),
                     {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)});
}

std::size_t GltfBinary::addIndices(std::span<const std::uint32_t> values) {
  return addAccessor(values.size(), 5125, "SCALAR",
                     {reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

void GltfBinary::install(nlohmann::json& gltf) {
  gltf["accessors"] = std::move(accessors_);
  gltf["bufferViews"] = std::move(views_);
  nlohmann::json buffer = nlohmann::json::object();
  buffer["byteLength"] = bytes_.size();
  gltf["buffers"] = nlohmann::json::array();
  gltf["buffers"].push_back(std::move(buffer));
}

std::string makeGlbStart(std::string json, std::size_t rest) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::size_t size = kGlbHeader + json.size() + rest;
  if (size > 0xffffffff) return "";
  std::string glb = "glTF";
  for (const std::size_t word : {std::size_t{2}, size, json.size()}) appendGlbWord(glb, word);
  return glb.append("JSON").append(json);
}

std::string GltfBinary::makeGlb(std::string json) const {
  const std::size_t binary = (bytes_.size() + 3) / 4 * 4;
  std::string glb = makeGlbStart(std::move(json), kGlbChunkHeader + binary);
  if (glb.empty()) return "";
  const std::size_t size = glb.size() + kGlbChunkHeader + binary;
  glb.reserve(size);
  appendGlbWord(glb, binary);
  glb.append("BIN").append(1, '\0').append(bytes_);
  glb.resize(size, '\0');
  return glb;
}

}  // namespace enfilade::scene
