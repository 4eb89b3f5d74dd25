#include "server/export/glb_file.hpp"

#include <algorithm>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <string_view>

namespace enfilade::server {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF is little-endian");

// glTF 2.0, 3.6.2.2, 5.11.5 and 4.4.
constexpr int kUnsignedShort = 5123, kUnsignedInt = 5125, kFloatComponent = 5126;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr std::uint32_t kGlbMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr std::size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
constexpr std::size_t kMaxFileBytes = 0xFFFFFFFF;  // lengths have 32 bits
/// 65535 as an index of 16 bits means the restart of a primitive.
constexpr std::size_t kMaxShortVertices = 65535;

void appendWord(std::vector<std::uint8_t>& into, std::size_t word) {
  const auto value = static_cast<std::uint32_t>(word);
  const auto* bytes = reinterpret_cast<const std::uint8_t*>(&value);
  into.insert(into.end(), bytes, bytes + sizeof value);
}

std::size_t roundUpToWord(std::size_t bytes) {
  return (bytes + 3) / 4 * 4;
}

std::size_t countComponents(std::string_view type) {
  if (type == "VEC4") return 4;
  return type == "VEC3" ? 3 : type == "VEC2" ? 2 : 1;
}

}  // namespace

GlbFile::GlbFile() : root{{"asset", {{"version", "2.0"}, {"generator", "enfilade"}}}} {}

std::size_t GlbFile::add(const char* list, GlbJson value) {
  root[list].push_back(std::move(value));
  return root[list].size() - 1;
}

std::size_t GlbFile::addView(const void* data, std::size_t bytes, GlbTarget target) {
  buffer_.resize(roundUpToWord(buffer_.size()));
  GlbJson view{{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes}};
  if (target != GlbTarget::other)
    view["target"] = target == GlbTarget::indices ? kElementArrayBuffer : kArrayBuffer;
  const auto* first = static_cast<const std::uint8_t*>(data);
  buffer_.insert(buffer_.end(), first, first + bytes);
  return add("bufferViews", std::move(view));
}

std::size_t GlbFile::addFloats(std::span<const float> numbers, const char* type, GlbTarget target) {
  const std::size_t view = addView(numbers.data(), numbers.size_bytes(), target);
  return add("accessors", {{"bufferView", view},
                           {"componentType", kFloatComponent},
                           {"count", numbers.size() / countComponents(type)},
                           {"type", type}});
}

std::size_t GlbFile::addPositions(std::span<const float> numbers) {
  const std::size_t accessor = addFloats(numbers, "VEC3", GlbTarget::vertices);
  float min[3], max[3];
  std::copy_n(numbers.begin(), 3, min);
  std::copy_n(numbers.begin(), 3, max);
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    min[i % 3] = std::min(min[i % 3], numbers[i]);
    max[i % 3] = std::max(max[i % 3], numbers[i]);
  }
  root["accessors"][accessor]["min"] = min;
  root["accessors"][accessor]["max"] = max;
  return accessor;
}

std::size_t GlbFile::addColours(std::span<const std::uint16_t> numbers) {
  const std::size_t view = addView(numbers.data(), numbers.size_bytes(), GlbTarget::vertices);
  return add("accessors", {{"bufferView", view},
                           {"componentType", kUnsignedShort},
                           {"normalized", true},
                           {"count", numbers.size() / 4},
                           {"type", "VEC4"}});
}

std::size_t GlbFile::addIndices(std::span<const std::uint32_t> indices, std::size_t vertexCount) {
  const bool isShort = vertexCount <= kMaxShortVertices;
  std::size_t view = 0;
  if (isShort) {
    const std::vector<std::uint16_t> narrow(indices.begin(), indices.end());
    view = addView(narrow.data(), 2 * narrow.size(), GlbTarget::indices);
  } else {
    view = addView(indices.data(), indices.size_bytes(), GlbTarget::indices);
  }
  return add("accessors", {{"bufferView", view},
                           {"componentType", isShort ? kUnsignedShort : kUnsignedInt},
                           {"count", indices.size()},
                           {"type", "SCALAR"}});
}

std::size_t GlbFile::addImage(std::span<const std::uint8_t> bytes, const char* mimeType,
                              const std::string& name) {
  const std::size_t view = addView(bytes.data(), bytes.size(), GlbTarget::other);
  GlbJson image{{"bufferView", view}, {"mimeType", mimeType}};
  if (!name.empty()) image["name"] = name;
  return add("images", std::move(image));
}

std::vector<std::uint8_t> GlbFile::finish() {
  if (!buffer_.empty()) root["buffers"] = {{{"byteLength", buffer_.size()}}};
  buffer_.resize(roundUpToWord(buffer_.size()));
  std::string json = root.dump(-1, ' ', false, GlbJson::error_handler_t::replace);
  json.resize(roundUpToWord(json.size()), ' ');
  std::size_t bytes = kHeaderBytes + kChunkHeaderBytes + json.size();
  if (!buffer_.empty()) bytes += kChunkHeaderBytes + buffer_.size();
  if (bytes > kMaxFileBytes)
    throw std::runtime_error("the content is too large for a GLB file: it needs " +
                             std::to_string(bytes >> 20) + " MiB, and the format ends at 4096 MiB");
  std::vector<std::uint8_t> file;
  file.reserve(bytes);
  appendWord(file, kGlbMagic);
  appendWord(file, 2);
  appendWord(file, bytes);
  appendWord(file, json.size());
  appendWord(file, kJsonChunk);
  file.insert(file.end(), json.begin(), json.end());
  if (buffer_.empty()) return file;
  appendWord(file, buffer_.size());
  appendWord(file, kBinaryChunk);
  file.insert(file.end(), buffer_.begin(), buffer_.end());
  return file;
}

}  // namespace enfilade::server
