#include "scene/import/gltf/gltf_buffers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/uri.hpp"
#include "scene/import/gltf/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxBufferBytes = std::size_t{4} << 30;  // per buffer
constexpr std::size_t kMaxAccessorNumbers = 100'000'000;       // per accessor
constexpr std::size_t kFirstChunkOffset = 12,
                      kChunkHeaderSize = 8;  // bytes; a chunk has length, then type

/// Size in bytes (glTF 2.0, 5.1.3); 0: not a supported component type.
std::size_t getComponentSize(std::size_t componentType) {
  switch (componentType) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5126:
      return 4;
    default:
      return 0;
  }
}

template <class Value>
double readValue(const char* bytes) {
  Value value{};
  std::memcpy(&value, bytes, sizeof value);
  if constexpr (std::is_floating_point_v<Value>) return static_cast<double>(value);
  // Normalised integers: glTF 2.0, 3.6.2.1.2.
  return std::max(static_cast<double>(value) / std::numeric_limits<Value>::max(), -1.0);
}

double readComponent(const char* bytes, std::size_t componentType) {
  switch (componentType) {
    case 5120:
      return readValue<std::int8_t>(bytes);
    case 5121:
      return readValue<std::uint8_t>(bytes);
    case 5122:
      return readValue<std::int16_t>(bytes);
    case 5123:
      return readValue<std::uint16_t>(bytes);
    default:
      return readValue<float>(bytes);
  }
}

int decodeBase64Digit(char letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A';
  if (letter >= 'a' && letter <= 'z') return letter - 'a' + 26;
  if (letter >= '0' && letter <= '9') return letter - '0' + 52;
  if (letter == '+') return 62;
  return letter == '/' ? 63 : -1;
}

/// Decodes RFC 4648; the first character outside its alphabet ends the text.
std::string decodeBase64(std::string_view text) {
  std::string bytes;
  unsigned accumulator = 0;
  int bits = 0;
  for (const char letter : text) {
    const int six = decodeBase64Digit(letter);
    if (six < 0) break;
    accumulator = (accumulator << 6U | static_cast<unsigned>(six)) & 0xFFFFFFU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(accumulator >> static_cast<unsigned>(bits) & 255U);
  }
  return bytes;
}

std::string readFileBytes(const std::filesystem::path& file, std::size_t from) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || size < from || size - from > kMaxBufferBytes) return {};
  std::string bytes(static_cast<std::size_t>(size) - from, '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(from));
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return in ? bytes : std::string();
}

/// The second chunk of a GLB file (glTF 2.0, 4.4): its first buffer.
std::string readBinaryChunk(const std::filesystem::path& file) {
  const std::string all = readFileBytes(file, 0);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 <= all.size()) std::memcpy(&value, all.data() + at, 4);
    return std::size_t{value};
  };
  const std::size_t second = kFirstChunkOffset + kChunkHeaderSize + word(kFirstChunkOffset);
  const std::size_t start = second + kChunkHeaderSize;
  if (start > all.size() || start + word(second) > all.size()) return {};
  return all.substr(start, word(second));
}

}  // namespace

GltfBuffers::GltfBuffers(std::filesystem::path file, ModelFormat format, const Json& json)
    : file_(std::move(file)), format_(format), json_(json) {}

void GltfBuffers::fail(const std::string& message) const {
  throw ImportError(file_.string() + ": " + message + "; export the file again (open)");
}

const Json& GltfBuffers::getEntry(const char* list, std::size_t index) const {
  const auto found = json_.find(list);
  if (found == json_.end() || !found->is_array() || index >= found->size() ||
      !(*found)[index].is_object())
    fail(std::string("missing ") + list + "[" + std::to_string(index) + "]");
  return (*found)[index];
}

std::size_t GltfBuffers::getInteger(const Json& object, const char* key,
                                    std::size_t fallback) const {
  const auto found = object.find(key);
  if (found == object.end()) return fallback;
  if (!found->is_number_unsigned() || found->get<std::size_t>() > kMaxBufferBytes)
    fail(std::string(key) + " is not a valid whole number");
  return found->get<std::size_t>();
}

std::string GltfBuffers::readBuffer(std::size_t index) const {
  const Json& buffer = getEntry("buffers", index);
  if (!buffer.contains("uri")) return format_ == ModelFormat::glb ? readBinaryChunk(file_) : "";
  if (!buffer["uri"].is_string()) fail("a buffer's uri is not a string");
  const std::string uri = buffer["uri"].get<std::string>();
  if (!uri.starts_with("data:")) return readFileBytes(file_.parent_path() / decodePercent(uri), 0);
  const std::size_t comma = uri.find(',');
  return comma == std::string::npos ? "" : decodeBase64(std::string_view(uri).substr(comma + 1));
}

const std::string& GltfBuffers::getBuffer(std::size_t index) {
  const auto [at, isNew] = buffers_.try_emplace(index);
  if (isNew) at->second = readBuffer(index);
  if (at->second.empty())
    fail("buffers[" + std::to_string(index) + "] is missing, empty or cannot be read");
  return at->second;
}

GltfBuffers::Slice GltfBuffers::makeSlice(const Json& accessor, std::size_t elementBytes,
                                          std::size_t count) {
  const std::size_t viewIndex = getInteger(accessor, "bufferView", kNoIndex);
  if (viewIndex == kNoIndex || accessor.contains("sparse"))
    fail("sparse accessors are not supported in animations");
  const Json& view = getEntry("bufferViews", viewIndex);
  Slice slice{&getBuffer(getInteger(view, "buffer", kNoIndex)), 0,
              getInteger(view, "byteStride", elementBytes)};
  slice.first = getInteger(view, "byteOffset", 0) + getInteger(accessor, "byteOffset", 0);
  if (slice.stride < elementBytes) fail("a byteStride is smaller than its elements");
  const std::size_t last = slice.first + (count - 1) * slice.stride + elementBytes;
  if (last > slice.bytes->size()) fail("an accessor extends beyond its buffer");
  return slice;
}

std::vector<double> GltfBuffers::readNumbers(std::size_t accessorIndex, std::size_t perElement) {
  static constexpr std::array<const char*, 5> kTypes{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const Json& accessor = getEntry("accessors", accessorIndex);
  const std::size_t type = getInteger(accessor, "componentType", 0);
  const std::size_t count = getInteger(accessor, "count", 0);
  const auto name = accessor.find("type");
  if (name == accessor.end() || *name != kTypes.at(perElement) || getComponentSize(type) == 0)
    fail("accessors[" + std::to_string(accessorIndex) + "] is not of type " +
         kTypes.at(perElement) + " of floats");
  if (count == 0 || count > kMaxAccessorNumbers / perElement)
    fail("accessors[" + std::to_string(accessorIndex) + "] has " + std::to_string(count) +
         " elements");
  const Slice slice = makeSlice(accessor, perElement * getComponentSize(type), count);
  std::vector<double> values;
  values.reserve(count * perElement);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < perElement; ++k) {
      const std::size_t at = slice.first + i * slice.stride + k * getComponentSize(type);
      values.push_back(readComponent(slice.bytes->data() + at, type));
      if (!std::isfinite(values.back())) fail("an animation contains a non-finite number");
    }
  }
  return values;
}

}  // namespace enfilade::scene
