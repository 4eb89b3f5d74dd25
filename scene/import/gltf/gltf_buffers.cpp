#include "scene/import/gltf/gltf_buffers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>

#include "scene/import/import_model.hpp"
#include "scene/import/worker/uri.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostBytes = std::size_t{4} << 30;   // of one buffer
constexpr std::size_t kMostNumbers = 100'000'000;          // of one accessor
constexpr std::size_t kFirstChunk = 12, kChunkHeader = 8;  // bytes; a length, then a type

/// glTF 2.0, 5.1.3. 0: no component type.
std::size_t bytesOf(std::size_t componentType) {
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
double valueAt(const char* bytes) {
  Value value{};
  std::memcpy(&value, bytes, sizeof value);
  if constexpr (std::is_floating_point_v<Value>) return static_cast<double>(value);
  // Normalised integers, glTF 2.0, 3.6.2.1.2.
  return std::max(static_cast<double>(value) / std::numeric_limits<Value>::max(), -1.0);
}

double component(const char* bytes, std::size_t componentType) {
  switch (componentType) {
    case 5120:
      return valueAt<std::int8_t>(bytes);
    case 5121:
      return valueAt<std::uint8_t>(bytes);
    case 5122:
      return valueAt<std::int16_t>(bytes);
    case 5123:
      return valueAt<std::uint16_t>(bytes);
    default:
      return valueAt<float>(bytes);
  }
}

int sixBits(char letter) {
  if (letter >= 'A' && letter <= 'Z') return letter - 'A';
  if (letter >= 'a' && letter <= 'z') return letter - 'a' + 26;
  if (letter >= '0' && letter <= '9') return letter - '0' + 52;
  if (letter == '+') return 62;
  return letter == '/' ? 63 : -1;
}

/// RFC 4648; what is no letter of it ends the text.
std::string decodedBase64(std::string_view text) {
  std::string bytes;
  unsigned held = 0;
  int bits = 0;
  for (const char letter : text) {
    const int six = sixBits(letter);
    if (six < 0) break;
    held = (held << 6U | static_cast<unsigned>(six)) & 0xFFFFFFU;
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(held >> static_cast<unsigned>(bits) & 255U);
  }
  return bytes;
}

std::string wholeFile(const std::filesystem::path& file, std::size_t from) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  if (error || size < from || size - from > kMostBytes) return {};
  std::string bytes(static_cast<std::size_t>(size) - from, '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(from));
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return in ? bytes : std::string();
}

/// The second chunk of a GLB file (glTF 2.0, 4.4), which is its first buffer.
std::string binaryChunk(const std::filesystem::path& file) {
  const std::string all = wholeFile(file, 0);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    if (at + 4 <= all.size()) std::memcpy(&value, all.data() + at, 4);
    return std::size_t{value};
  };
  const std::size_t second = kFirstChunk + kChunkHeader + word(kFirstChunk);
  const std::size_t start = second + kChunkHeader;
  if (start > all.size() || start + word(second) > all.size()) return {};
  return all.substr(start, word(second));
}

}  // namespace

GltfBuffers::GltfBuffers(std::filesystem::path file, ModelFormat format, const Json& json)
    : file_(std::move(file)), format_(format), json_(json) {}

void GltfBuffers::refuse(const std::string& what) const {
  throw ImportError(file_.string() + ": " + what + "; export the file again (open)");
}

const Json& GltfBuffers::entry(const char* list, std::size_t index) const {
  const auto found = json_.find(list);
  if (found == json_.end() || !found->is_array() || index >= found->size() ||
      !(*found)[index].is_object())
    refuse(std::string("there is no ") + list + "[" + std::to_string(index) + "]");
  return (*found)[index];
}

std::size_t GltfBuffers::whole(const Json& object, const char* key, std::size_t otherwise) const {
  const auto found = object.find(key);
  if (found == object.end()) return otherwise;
  if (!found->is_number_unsigned() || found->get<std::size_t>() > kMostBytes)
    refuse(std::string(key) + " is no whole number that makes sense");
  return found->get<std::size_t>();
}

std::string GltfBuffers::read(std::size_t index) const {
  const Json& buffer = entry("buffers", index);
  if (!buffer.contains("uri")) return format_ == ModelFormat::glb ? binaryChunk(file_) : "";
  if (!buffer["uri"].is_string()) refuse("a buffer's uri is no text");
  const std::string uri = buffer["uri"].get<std::string>();
  if (!uri.starts_with("data:")) return wholeFile(file_.parent_path() / percentDecoded(uri), 0);
  const std::size_t comma = uri.find(',');
  return comma == std::string::npos ? "" : decodedBase64(std::string_view(uri).substr(comma + 1));
}

const std::string& GltfBuffers::buffer(std::size_t index) {
  const auto [at, isNew] = buffers_.try_emplace(index);
  if (isNew) at->second = read(index);
  if (at->second.empty())
    refuse("buffers[" + std::to_string(index) + "] is missing, empty or cannot be read");
  return at->second;
}

GltfBuffers::Slice GltfBuffers::sliceOf(const Json& accessor, std::size_t elementBytes,
                                        std::size_t count) {
  constexpr std::size_t kNone = ~std::size_t{0};
  const std::size_t viewIndex = whole(accessor, "bufferView", kNone);
  if (viewIndex == kNone || accessor.contains("sparse"))
    refuse("sparse accessors of animations are not read");
  const Json& view = entry("bufferViews", viewIndex);
  Slice slice{&buffer(whole(view, "buffer", kNone)), 0, whole(view, "byteStride", elementBytes)};
  slice.first = whole(view, "byteOffset", 0) + whole(accessor, "byteOffset", 0);
  if (slice.stride < elementBytes) refuse("a byteStride is smaller than its elements");
  const std::size_t last = slice.first + (count - 1) * slice.stride + elementBytes;
  if (last > slice.bytes->size()) refuse("an accessor reaches beyond its buffer");
  return slice;
}

std::vector<double> GltfBuffers::numbers(std::size_t accessorIndex, std::size_t perElement) {
  static constexpr std::array<const char*, 5> kTypes{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const Json& accessor = entry("accessors", accessorIndex);
  const std::size_t type = whole(accessor, "componentType", 0);
  const std::size_t count = whole(accessor, "count", 0);
  const auto name = accessor.find("type");
  if (name == accessor.end() || *name != kTypes.at(perElement) || bytesOf(type) == 0)
    refuse("accessors[" + std::to_string(accessorIndex) + "] is not of type " +
           kTypes.at(perElement) + " of floats");
  if (count == 0 || count > kMostNumbers / perElement)
    refuse("accessors[" + std::to_string(accessorIndex) + "] has " + std::to_string(count) +
           " elements");
  const Slice slice = sliceOf(accessor, perElement * bytesOf(type), count);
  std::vector<double> values;
  values.reserve(count * perElement);
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < perElement; ++k) {
      const std::size_t at = slice.first + i * slice.stride + k * bytesOf(type);
      values.push_back(component(slice.bytes->data() + at, type));
      if (!std::isfinite(values.back())) refuse("an animation holds a number that is not finite");
    }
  }
  return values;
}

}  // namespace enfilade::scene
