#include "scene/import/gltf/encoding/gltf_json.hpp"

#include <array>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

namespace enfilade::scene {
namespace {

constexpr std::size_t kGlbHeader = 20;  // bytes: file header and header of the first chunk

}  // namespace

std::string readGltfJson(const std::filesystem::path& file, ModelFormat format) {
  std::ifstream in(file, std::ios::binary);
  if (format == ModelFormat::gltf) return {std::istreambuf_iterator<char>(in), {}};
  std::array<char, kGlbHeader> header{};
  in.read(header.data(), header.size());
  std::uint32_t length = 0;
  std::memcpy(&length, header.data() + 12, sizeof length);
  std::error_code error;
  if (!in || length > file_size(file, error)) return {};
  std::string text(length, '\0');
  in.read(text.data(), length);
  return text;
}

bool mentions(const std::string& text, std::string_view words) {
  return memmem(text.data(), text.size(), words.data(), words.size()) != nullptr;
}

const nlohmann::json* findMember(const nlohmann::json* json, const char* key) {
  if (json == nullptr || !json->is_object()) return nullptr;
  const auto found = json->find(key);
  return found == json->end() ? nullptr : &*found;
}

const nlohmann::json& getArray(const nlohmann::json& json, const char* key) {
  static const nlohmann::json kEmpty = nlohmann::json::array();
  const nlohmann::json* found = findMember(&json, key);
  return found != nullptr && found->is_array() ? *found : kEmpty;
}

const nlohmann::json* findEntry(const nlohmann::json& array, const nlohmann::json* index) {
  const bool exists =
      index != nullptr && index->is_number_unsigned() && index->get<std::size_t>() < array.size();
  return exists ? &array[index->get<std::size_t>()] : nullptr;
}

std::optional<std::size_t> readIndexMember(const nlohmann::json* json, const char* key) {
  const nlohmann::json* value = findMember(json, key);
  if (value == nullptr || !value->is_number_unsigned()) return std::nullopt;
  return value->get<std::size_t>();
}

}  // namespace enfilade::scene
