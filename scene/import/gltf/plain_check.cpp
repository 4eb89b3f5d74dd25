#include "scene/import/gltf/plain_check.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "scene/import/gltf/encoding/data_uri.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/encoding/texture_mapping.hpp"
#include "scene/import/gltf/gltf_materials.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// Texts in the JSON of a file that may need rewriting. Exporters sometimes forget to list an
/// extension in extensionsUsed, so the whole text is searched.
constexpr std::array<std::string_view, 16> kRewrittenTexts{
    "\"skin\"",  // one that does not exist is reported
    "\"skins\"",
    "\"targets\"",
    "\"EXT_meshopt_compression\"",
    "\"KHR_meshopt_compression\"",
    "\"KHR_draco_mesh_compression\"",
    "\"EXT_mesh_gpu_instancing\"",
    "\"KHR_texture_basisu\"",
    "\"EXT_texture_webp\"",
    "\"KHR_texture_transform\"",
    "\"sparse\"",
    "\"EXT_texture_avif\"",
    "\"KHR_materials_pbrSpecularGlossiness\"",
    "\"DATA:",
    "\"Data:",
    ";BASE64,"};

// ---- accessors ----------------------------------------------------------------------------------

/// A member that is a whole number; `absent` without the member, nullopt for anything else.
std::optional<std::size_t> readWhole(const Json* json, const char* key, std::size_t absent) {
  const Json* value = findMember(json, key);
  if (value == nullptr) return absent;
  return value->is_number_unsigned() ? std::optional(value->get<std::size_t>()) : std::nullopt;
}

/// Whether the elements lie within their buffer view, and the view within its buffer.
bool liesWithinBuffer(const Json& sections, const Json& accessor, std::size_t elementBytes) {
  const Json* view =
      findEntry(getArray(sections, "bufferViews"), findMember(&accessor, "bufferView"));
  const Json* buffer = findEntry(getArray(sections, "buffers"), findMember(view, "buffer"));
  if (buffer == nullptr) return false;
  const auto size = readIndexMember(buffer, "byteLength");
  const auto first = readWhole(view, "byteOffset", 0), length = readIndexMember(view, "byteLength");
  const auto stride = readWhole(view, "byteStride", elementBytes);
  const auto offset = readWhole(&accessor, "byteOffset", 0);
  const auto count = readIndexMember(&accessor, "count");
  if (!size || !first || !length || !stride || !offset || !count) return false;
  return *length <= *size && *first <= *size - *length && *stride >= elementBytes && *count > 0 &&
         elementBytes <= *length && *offset <= *length - elementBytes &&
         *count - 1 <= (*length - elementBytes - *offset) / *stride;
}

/// Whether assimp reads the accessor of an attribute right: `width` floats each in a buffer view.
/// It does not check the type, the stride and the range.
bool isPlainAttribute(const Json& sections, const Json* accessor, std::size_t width) {
  static constexpr std::array<const char*, 5> kTypes{"", "SCALAR", "VEC2", "VEC3", "VEC4"};
  const Json* type = findMember(accessor, "type");
  return type != nullptr && *type == kTypes.at(width) &&
         readIndexMember(accessor, "componentType") == 5126 &&
         liesWithinBuffer(sections, *accessor, width * sizeof(float));
}

/// Whether a primitive has no indices, or unsigned integers without gaps.
bool hasPlainIndices(const Json& primitive, const Json& sections) {
  const Json* index = findMember(&primitive, "indices");
  if (index == nullptr) return true;
  const Json* accessor = findEntry(getArray(sections, "accessors"), index);
  const Json* type = findMember(accessor, "type");
  if (type == nullptr || *type != "SCALAR") return false;
  const std::size_t component = readIndexMember(accessor, "componentType").value_or(0);
  if (component != 5121 && component != 5123 && component != 5125) return false;
  const Json* view =
      findEntry(getArray(sections, "bufferViews"), findMember(accessor, "bufferView"));
  const std::size_t bytes = component == 5121 ? 1 : component == 5123 ? 2 : 4;
  return readWhole(view, "byteStride", bytes) == bytes &&
         liesWithinBuffer(sections, *accessor, bytes);
}

// ---- primitives ---------------------------------------------------------------------------------

/// Whether the corners of a primitive make whole triangles.
bool hasWholeTriangles(const Json& primitive, const Json& accessors, const Json* positions) {
  const Json* indices = findMember(&primitive, "indices");
  const Json* corners = indices == nullptr ? positions : findEntry(accessors, indices);
  return readIndexMember(corners, "count").value_or(1) % 3 == 0;
}

bool hasPlainMaterial(const Json& primitive, const Json& sections) {
  const Json* material = findMember(&primitive, "material");
  return material == nullptr || findEntry(getArray(sections, "materials"), material) != nullptr;
}

/// Whether a primitive has the coordinates of its texture; its set 0, as usesFirstTexCoords().
bool hasTexCoords(const Json& primitive, const Json& attributes, const Json& sections) {
  const std::size_t material = readIndexMember(&primitive, "material").value_or(kNoIndex);
  return !readTextureMapping(sections, material).isTextured || attributes.contains("TEXCOORD_0");
}

/// Whether assimp reads a primitive right, without a word of what it left out.
bool isPlainPrimitive(const Json& primitive, const Json& sections) {
  const std::size_t mode = readWhole(&primitive, "mode", 4).value_or(kNoIndex);
  if (mode > 4) return false;  // strips, fans and modes that glTF does not know
  const Json* attributes = findMember(&primitive, "attributes");
  if (attributes == nullptr || !attributes->is_object()) return false;
  if (!hasPlainMaterial(primitive, sections) || !hasPlainIndices(primitive, sections) ||
      !hasTexCoords(primitive, *attributes, sections))
    return false;
  const Json& accessors = getArray(sections, "accessors");
  const Json* positions = findEntry(accessors, findMember(attributes, "POSITION"));
  if (positions == nullptr) return false;
  if (mode == 4 && !hasWholeTriangles(primitive, accessors, positions)) return false;
  return std::all_of(attributes->items().begin(), attributes->items().end(), [&](const auto& item) {
    const std::string& name = item.key();
    const Json* accessor = findEntry(accessors, &item.value());
    if (name == "POSITION" || name == "NORMAL") return isPlainAttribute(sections, accessor, 3);
    if (name.starts_with("TEXCOORD_")) return isPlainAttribute(sections, accessor, 2);
    return name != "COLOR_0" ||
           (isPlainAttribute(sections, accessor, 4) &&
            readIndexMember(accessor, "count") == readIndexMember(positions, "count"));
  });
}

/// A mesh without primitives would vanish in silence.
bool isPlainMesh(const Json& mesh, const Json& sections) {
  const Json& primitives = getArray(mesh, "primitives");
  return !primitives.empty() &&
         std::all_of(primitives.begin(), primitives.end(),
                     [&](const Json& primitive) { return isPlainPrimitive(primitive, sections); });
}

// ---- buffers ------------------------------------------------------------------------------------

/// assimp does not say well that a buffer is missing or cut off.
bool isPlainBuffer(const Json& buffer, std::size_t index, const std::filesystem::path& file,
                   ModelFormat format) {
  const auto length = readIndexMember(&buffer, "byteLength");
  if (!length) return false;
  const Json* uri = findMember(&buffer, "uri");
  if (uri == nullptr)
    return format == ModelFormat::glb && index == 0 && findGlbBinary(file).size >= *length;
  if (!uri->is_string()) return false;
  const auto& text = uri->get_ref<const std::string&>();
  if (isDataUri(text)) return isPlainDataUri(text, *length);
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(file.parent_path() / text, error);
  return !error && size >= *length;
}

bool hasPlainBuffers(const Json& sections, const std::filesystem::path& file, ModelFormat format) {
  const Json& buffers = getArray(sections, "buffers");
  for (std::size_t i = 0; i < buffers.size(); ++i)
    if (!isPlainBuffer(buffers[i], i, file, format)) return false;
  return true;
}

/// The import takes the first set of texture coordinates from assimp.
bool usesFirstTexCoords(const Json& sections) {
  for (std::size_t i = 0; i < getArray(sections, "materials").size(); ++i)
    if (readTextureMapping(sections, i).set != 0) return false;
  return true;
}

}  // namespace

bool needsRewriting(const std::string& text, const Json& sections,
                    const std::filesystem::path& file, ModelFormat format) {
  const bool extended = std::any_of(kRewrittenTexts.begin(), kRewrittenTexts.end(),
                                    [&](std::string_view mark) { return mentions(text, mark); });
  if (extended || !hasPlainBuffers(sections, file, format) || !usesFirstTexCoords(sections) ||
      !hasPlainTextures(sections))
    return true;
  const Json& meshes = getArray(sections, "meshes");
  return !std::all_of(meshes.begin(), meshes.end(),
                      [&](const Json& mesh) { return isPlainMesh(mesh, sections); });
}

bool isRewrittenExtension(const std::string& name) {
  return std::find(kRewrittenTexts.begin(), kRewrittenTexts.end(), "\"" + name + "\"") !=
         kRewrittenTexts.end();
}

}  // namespace enfilade::scene
