#include "scene/import/gltf/encoding/gltf_json.hpp"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>

#include "scene/import/file/import_options.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kJsonLengthAt = 12;  // bytes: length of the first chunk

/// A number of 32 bits at `at`; 0 beyond the end of the file.
std::uint32_t readGlbWord(std::ifstream& in, std::size_t at) {
  std::uint32_t value = 0;
  in.seekg(static_cast<std::streamoff>(at));
  in.read(reinterpret_cast<char*>(&value), sizeof value);
  return in ? value : 0;
}

}  // namespace

void refuseDeepNodes(const std::string& file) {
  throw ImportError(file + "nodes are nested more than " + std::to_string(kMaxNodeDepth) +
                    " levels deep; re-export the file with a flatter tree");
}

std::string readGltfJson(const std::filesystem::path& file, ModelFormat format) {
  std::ifstream in(file, std::ios::binary);
  if (format == ModelFormat::gltf) return {std::istreambuf_iterator<char>(in), {}};
  const std::size_t length = readGlbWord(in, kJsonLengthAt);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || kGlbHeader + length > size)
    throw ImportError(file.string() + ": its header announces " + std::to_string(length) +
                      " bytes of JSON, the file has " + std::to_string(size) +
                      "; copy or export it again");
  std::string text(length, '\0');
  in.seekg(kGlbHeader);
  in.read(text.data(), static_cast<std::streamsize>(length));
  return text;
}

GlbBinary findGlbBinary(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  GlbBinary binary{kGlbHeader + readGlbWord(in, kJsonLengthAt), 0};
  const std::size_t length = readGlbWord(in, binary.chunkAt);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (!error && binary.chunkAt + kGlbChunkHeader + length <= size) binary.size = length;
  return binary;
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
