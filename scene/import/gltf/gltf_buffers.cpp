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
#include "scene/import/gltf/encoding/data_uri.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/encoding/meshopt_view.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMaxBufferBytes = std::size_t{4} << 30;     // per buffer
constexpr std::size_t kMaxAccessorNumbers = 1'000'000'000;        // per accessor
constexpr std::size_t kMaxExpansion = 256, kFreeBytes = 1 << 20;  // see the header

/// Size in bytes (glTF 2.0, 5.1.3); 0: not a component type.
std::size_t getComponentSize(std::size_t componentType) {
  switch (componentType) {
    case 5120:
    case 5121:
      return 1;
    case 5122:
    case 5123:
      return 2;
    case 5125:
    case 5126:
      return 4;
    default:
      return 0;
  }
}

template <class Value>
double readValue(const char* bytes, bool normalised) {
  Value value{};
  std::memcpy(&value, bytes, sizeof value);
  if (std::is_floating_point_v<Value> || !normalised) return static_cast<double>(value);
  // Normalised integers: glTF 2.0, 3.6.2.2.
  return std::max(
      static_cast<double>(value) / static_cast<double>(std::numeric_limits<Value>::max()), -1.0);
}

double readComponent(const char* bytes, std::size_t componentType, bool normalised) {
  switch (componentType) {
    case 5120:
      return readValue<std::int8_t>(bytes, normalised);
    case 5121:
      return readValue<std::uint8_t>(bytes, normalised);
    case 5122:
      return readValue<std::int16_t>(bytes, normalised);
    case 5123:
      return readValue<std::uint16_t>(bytes, normalised);
    case 5125:
      return readValue<std::uint32_t>(bytes, normalised);
    default:
      return readValue<float>(bytes, normalised);
  }
}

template <class Number>
std::vector<Number> convertElements(const GltfElements& elements, bool normalise) {
  const std::size_t size = getComponentSize(elements.componentType);
  std::vector<Number> values;
  values.reserve(elements.bytes.size() / size);
  for (std::size_t at = 0; at < elements.bytes.size(); at += size)
    values.push_back(static_cast<Number>(
        readComponent(elements.bytes.data() + at, elements.componentType, normalise)));
  return values;
}

/// "" if the file is shorter.
std::string readFileBytes(const std::filesystem::path& file, std::size_t from, std::size_t size) {
  std::string bytes(size, '\0');
  std::ifstream in(file, std::ios::binary);
  in.seekg(static_cast<std::streamoff>(from));
  in.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  return in ? bytes : std::string();
}

/// The first buffer of a GLB file.
std::string readBinaryChunk(const std::filesystem::path& file) {
  const GlbBinary binary = findGlbBinary(file);
  return readFileBytes(file, binary.chunkAt + kGlbChunkHeader, binary.size);
}

std::string readWholeFile(const std::filesystem::path& file) {
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file, error);
  if (error || size > kMaxBufferBytes) return {};
  return readFileBytes(file, 0, static_cast<std::size_t>(size));
}

}  // namespace

GltfBuffers::GltfBuffers(std::filesystem::path file, ModelFormat format, const Json& json)
    : file_(std::move(file)), format_(format), json_(json) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file_, error);
  if (!error) loaded_ = static_cast<std::size_t>(size);
}

void GltfBuffers::fail(const std::string& message) const {
  throw ImportError(file_.string() + ": " + message + "; export the file again");
}

void GltfBuffers::spend(std::size_t count, std::size_t bytesEach, const std::string& what) {
  const std::size_t limit = kMaxExpansion * loaded_ + kFreeBytes;
  if (bytesEach > 0 && count > (limit - std::min(decoded_, limit)) / bytesEach)
    throw UnreadableGltf(file_.string() + ": " + what + " has " + std::to_string(count) +
                         " elements, more than the file's " + std::to_string(loaded_) +
                         " bytes can contain; export the file again");
  decoded_ += count * bytesEach;
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

// ---- buffers and views --------------------------------------------------------------------------

std::string GltfBuffers::readBuffer(std::size_t index) {
  const Json& buffer = getEntry("buffers", index);
  if (!buffer.contains("uri"))  // only the first buffer may be the binary chunk: 4.4.3.3
    return format_ == ModelFormat::glb && index == 0 ? readBinaryChunk(file_) : "";
  if (!buffer["uri"].is_string()) fail("a buffer's uri is not a string");
  const std::string uri = buffer["uri"].get<std::string>();
  if (isDataUri(uri)) {
    std::string fault;
    std::string bytes = decodeDataUri(uri, fault);
    if (!fault.empty()) fail("buffers[" + std::to_string(index) + "]: " + fault);
    return bytes;
  }
  for (const std::string& name : {uri, decodePercent(uri)}) {
    const std::filesystem::path path = file_.parent_path() / name;
    dependencies_.push_back(path.string());
    std::error_code error;
    if (!std::filesystem::is_regular_file(path, error)) continue;
    std::string bytes = readWholeFile(path);
    loaded_ += bytes.size();
    return bytes;
  }
  throw UnreadableGltf(file_.string() + ": its buffer '" + shortenUri(uri) +
                       "' is missing; put it next to the model, or export the file again");
}

const std::string& GltfBuffers::getBuffer(std::size_t index) {
  const auto [at, isNew] = buffers_.try_emplace(index);
  if (isNew) at->second = readBuffer(index);
  if (at->second.empty())
    fail("buffers[" + std::to_string(index) + "] is missing, empty or cannot be read");
  return at->second;
}

std::string_view GltfBuffers::sliceBuffer(const Json& place, const std::string& name) {
  const std::string& bytes = getBuffer(getInteger(place, "buffer", kNoIndex));
  const std::size_t first = getInteger(place, "byteOffset", 0);
  // Without a byteLength, which glTF requires, the rest of the buffer.
  const std::size_t rest = bytes.size() - std::min(first, bytes.size());
  const std::size_t size = getInteger(place, "byteLength", rest);
  if (first > bytes.size() || size > rest)
    fail(name + " extends beyond its buffer of " + std::to_string(bytes.size()) + " bytes");
  return std::string_view(bytes).substr(first, size);
}

std::string GltfBuffers::decodeView(const Json& compressed, const std::string& name) {
  MeshoptView view;
  view.count = getInteger(compressed, "count", 0);
  view.stride = getInteger(compressed, "byteStride", 0);
  view.mode = compressed.value("mode", Json()).is_string() ? compressed["mode"] : "";
  view.filter = compressed.value("filter", Json("NONE")).is_string()
                    ? compressed.value("filter", "NONE")
                    : std::string();
  view.source = sliceBuffer(compressed, name);
  spend(view.count, view.stride, name);
  std::string bytes;
  if (const std::string fault = decodeMeshoptView(view, bytes); !fault.empty())
    fail(name + ": " + fault);
  return bytes;
}

std::string_view GltfBuffers::getView(std::size_t index) {
  const std::string name = "bufferViews[" + std::to_string(index) + "]";
  const Json& view = getEntry("bufferViews", index);
  const Json* compressed = findMeshoptExtension(view);
  if (compressed == nullptr) return sliceBuffer(view, name);
  const auto known = decodedViews_.find(index);
  if (known != decodedViews_.end()) return known->second;
  return decodedViews_.emplace(index, decodeView(*compressed, name)).first->second;
}

// ---- accessors ----------------------------------------------------------------------------------

void GltfBuffers::copyElements(std::size_t view, std::size_t offset, std::size_t elementBytes,
                               std::size_t count, const std::string& name, std::string& to) {
  const std::string_view from = getView(view);
  const std::size_t stride = getInteger(getEntry("bufferViews", view), "byteStride", elementBytes);
  if (stride < elementBytes) fail(name + ": a byteStride is smaller than its elements");
  const bool inside = offset <= from.size() && from.size() - offset >= elementBytes &&
                      (count - 1) <= (from.size() - offset - elementBytes) / stride;
  if (!inside) fail(name + " extends beyond its buffer view");
  spend(count, elementBytes, name);
  to.resize(count * elementBytes);
  for (std::size_t i = 0; i < count; ++i)
    std::memcpy(to.data() + i * elementBytes, from.data() + offset + i * stride, elementBytes);
}

void GltfBuffers::applySparse(const Json& sparse, const std::string& name, GltfElements& to) {
  const Json* indices = findMember(&sparse, "indices");
  const Json* values = findMember(&sparse, "values");
  if (indices == nullptr || values == nullptr || !indices->is_object() || !values->is_object())
    fail(name + ": its sparse values are incomplete");
  const std::size_t count = getInteger(sparse, "count", 0);
  const std::size_t type = getInteger(*indices, "componentType", 0);
  if (type != 5121 && type != 5123 && type != 5125)
    fail(name + ": its sparse indices are not unsigned integers");
  if (count == 0) return;
  const std::size_t indexBytes = getComponentSize(type);
  const std::size_t elementBytes = to.width * getComponentSize(to.componentType);
  std::string places, replacements;
  copyElements(getInteger(*indices, "bufferView", kNoIndex), getInteger(*indices, "byteOffset", 0),
               indexBytes, count, name, places);
  copyElements(getInteger(*values, "bufferView", kNoIndex), getInteger(*values, "byteOffset", 0),
               elementBytes, count, name, replacements);
  for (std::size_t i = 0; i < count; ++i) {
    const auto at =
        static_cast<std::size_t>(readComponent(places.data() + i * indexBytes, type, false));
    if (at >= to.count) fail(name + ": a sparse index is out of range");
    std::memcpy(to.bytes.data() + at * elementBytes, replacements.data() + i * elementBytes,
                elementBytes);
  }
}

GltfElements GltfBuffers::readElements(std::size_t index, std::size_t width) {
  static constexpr std::array<const char*, 17> kTypes{
      "", "SCALAR", "VEC2", "VEC3", "VEC4", "", "", "", "", "", "", "", "", "", "", "", "MAT4"};
  const std::string name = "accessors[" + std::to_string(index) + "]";
  const Json& accessor = getEntry("accessors", index);
  GltfElements elements;
  elements.width = width;
  elements.componentType = getInteger(accessor, "componentType", 0);
  elements.count = getInteger(accessor, "count", 0);
  elements.normalised = accessor.value("normalized", Json(false)) == true;
  const auto type = accessor.find("type");
  const std::size_t componentBytes = getComponentSize(elements.componentType);
  if (type == accessor.end() || *type != kTypes.at(width) || componentBytes == 0)
    fail(name + " is not of type " + kTypes.at(width) + " of numbers");
  if (elements.count == 0 || elements.count > kMaxAccessorNumbers / width)
    fail(name + " has " + std::to_string(elements.count) + " elements");
  const std::size_t view = getInteger(accessor, "bufferView", kNoIndex);
  if (view == kNoIndex) {  // all zero: glTF 2.0, 3.6.2.3
    spend(elements.count, width * componentBytes, name);
    elements.bytes.resize(elements.count * width * componentBytes);
  } else {
    copyElements(view, getInteger(accessor, "byteOffset", 0), width * componentBytes,
                 elements.count, name, elements.bytes);
  }
  if (const Json* sparse = findMember(&accessor, "sparse")) applySparse(*sparse, name, elements);
  return elements;
}

std::vector<double> GltfBuffers::readNumbers(std::size_t accessor, std::size_t perElement) {
  const GltfElements elements = readElements(accessor, perElement);
  if (elements.componentType == 5125)
    fail("accessors[" + std::to_string(accessor) + "] is not of type floats");
  std::vector<double> values = convertElements<double>(elements, true);
  for (const double value : values)
    if (!std::isfinite(value)) fail("an animation contains a non-finite number");
  return values;
}

std::vector<float> GltfBuffers::readFloats(std::size_t accessor, std::size_t perElement,
                                           bool normalise) {
  const GltfElements elements = readElements(accessor, perElement);
  return convertElements<float>(elements, normalise || elements.normalised);
}

std::vector<double> GltfBuffers::readValues(std::size_t accessor, std::size_t& perElement) {
  const Json* type = findMember(&getEntry("accessors", accessor), "type");
  perElement = type != nullptr && *type == "VEC2"   ? 2
               : type != nullptr && *type == "VEC3" ? 3
               : type != nullptr && *type == "VEC4" ? 4
                                                    : 1;
  const GltfElements elements = readElements(accessor, perElement);
  spend(elements.count * perElement, sizeof(double), "accessors[" + std::to_string(accessor) + "]");
  return convertElements<double>(elements, elements.normalised);
}

std::vector<std::uint32_t> GltfBuffers::readIndices(std::size_t accessor) {
  const GltfElements elements = readElements(accessor, 1);
  const std::size_t type = elements.componentType, size = getComponentSize(type);
  if (type != 5121 && type != 5123 && type != 5125)
    fail("accessors[" + std::to_string(accessor) + "] is not of unsigned integers");
  std::vector<std::uint32_t> values;
  values.reserve(elements.count);
  for (std::size_t at = 0; at < elements.bytes.size(); at += size)
    values.push_back(
        static_cast<std::uint32_t>(readComponent(elements.bytes.data() + at, type, false)));
  return values;
}

}  // namespace enfilade::scene
