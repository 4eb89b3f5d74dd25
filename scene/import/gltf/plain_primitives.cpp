#include "scene/import/gltf/plain_primitives.hpp"

#include <algorithm>
#include <array>
#include <functional>
#include <numeric>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kColours = "COLOR_0";
// glTF 2.0, 5.24.4; points and lines are below.
constexpr std::size_t kTriangleMode = 4, kStripMode = 5, kFanMode = 6;
/// Bytes of Draco's output that count as one of those that the file must justify. Draco compresses
/// regular grids far better than other codecs, and draco_mesh.cpp bounds its counts itself.
constexpr std::size_t kDracoBytesPerByte = 32;

/// Colours without alpha become opaque, because assimp reads four channels.
std::vector<float> addAlpha(const std::vector<float>& rgb) {
  std::vector<float> rgba;
  rgba.reserve(rgb.size() / 3 * 4);
  for (std::size_t i = 0; i + 2 < rgb.size(); i += 3)
    rgba.insert(rgba.end(), {rgb[i], rgb[i + 1], rgb[i + 2], 1.0f});
  return rgba;
}

std::string getPlainName(const std::string& attribute) {
  return attribute.starts_with("TEXCOORD_") ? "TEXCOORD_0" : attribute;
}

}  // namespace

std::vector<std::uint32_t> unrollTriangles(const std::vector<std::uint32_t>& corners,
                                           std::size_t mode) {
  std::vector<std::uint32_t> triangles;
  if (corners.size() < 3) return triangles;
  triangles.reserve((corners.size() - 2) * 3);
  for (std::size_t i = 0; i + 2 < corners.size(); ++i) {
    const std::size_t odd = i % 2;
    std::array<std::uint32_t, 3> t{corners[i], corners[i + 1 + odd], corners[i + 2 - odd]};
    if (mode == kFanMode) t = {corners[i + 1], corners[i + 2], corners[0]};
    if (mode == kStripMode && (t[0] == t[1] || t[1] == t[2] || t[0] == t[2])) continue;
    triangles.insert(triangles.end(), t.begin(), t.end());
  }
  return triangles;
}

bool PlainPrimitives::isNormalised(const Json& accessor) const {
  const Json* normalised =
      findMember(findEntry(getArray(gltf_, "accessors"), &accessor), "normalized");
  return normalised != nullptr && *normalised == true;
}

std::size_t PlainPrimitives::countElements(std::size_t accessor) const {
  const Json& accessors = getArray(gltf_, "accessors");
  if (accessor >= accessors.size()) return 0;  // its reader reports it
  return readIndexMember(&accessors[accessor], "count").value_or(0);
}

/// Channels of the vertex colours: 3 or 4; 0 for none, or if they are not what glTF allows.
std::size_t PlainPrimitives::findColourWidth(const Json& attributes, const std::string& name) {
  if (!attributes.contains(kColours)) return 0;
  const Json& accessors = getArray(gltf_, "accessors");
  const Json* colours = findEntry(accessors, findMember(&attributes, kColours));
  const Json* type = findMember(colours, "type");
  const bool isRgb = type != nullptr && *type == "VEC3",
             isRgba = type != nullptr && *type == "VEC4";
  const std::size_t component = readIndexMember(colours, "componentType").value_or(0);
  const bool isNumber = component == 5121 || component == 5123 || component == 5126;
  const Json* positions = findEntry(accessors, findMember(&attributes, "POSITION"));
  const bool matches = positions != nullptr &&
                       readIndexMember(colours, "count") == readIndexMember(positions, "count");
  if ((isRgb || isRgba) && isNumber && matches) return isRgb ? 3 : 4;
  addDiagnostic(
      problems_, "vertex_colours_ignored",
      name + ": " + (matches ? "of a type that glTF does not allow" : "not one per vertex"));
  return 0;
}

PlainPrimitives::Widths PlainPrimitives::listAttributes(const Json& attributes,
                                                        const TextureMapping& mapping,
                                                        const std::string& name) {
  Widths widths{{"POSITION", 3}};
  if (attributes.contains("NORMAL")) widths["NORMAL"] = 3;
  const std::string uvs = "TEXCOORD_" + std::to_string(mapping.set);
  if (attributes.contains(uvs)) {
    widths[uvs] = 2;
  } else if (mapping.isTextured) {
    addDiagnostic(problems_, "missing_texture", name + " has no " + uvs);
  }
  if (const std::size_t channels = findColourWidth(attributes, name); channels > 0)
    widths[kColours] = channels;
  return widths;
}

std::size_t PlainPrimitives::writeFloats(const std::string& attribute, std::vector<float> values,
                                         std::size_t width, const TextureMapping& mapping) {
  if (width == 2 && !mapping.isIdentity()) mapping.apply(values);
  if (attribute == kColours && width == 3) return binary_.addFloats(addAlpha(values), 4);
  return binary_.addFloats(values, width);
}

std::size_t PlainPrimitives::writeAttribute(const std::string& attribute, std::size_t accessor,
                                            std::size_t width, const TextureMapping& mapping) {
  const bool colours = attribute == kColours;
  const std::string key =
      std::to_string(accessor) +
      (width == 2 ? " uv " + mapping.makeKey() : std::string(colours ? " colour" : " vector"));
  const auto known = written_.find(key);
  if (known != written_.end()) return known->second;
  return written_[key] =
             writeFloats(attribute, buffers_.readFloats(accessor, width, colours), width, mapping);
}

DracoMesh PlainPrimitives::decodeDraco(const Json& extension, const Json& attributes,
                                       const Widths& widths, const std::string& name) {
  DracoAttributes wanted;
  for (const auto& [attribute, width] : widths) {
    const auto id = readIndexMember(findMember(&extension, "attributes"), attribute.c_str());
    if (id && *id <= 0xffffffff)
      wanted[attribute] = {static_cast<std::uint32_t>(*id), width,
                           attribute == kColours || isNormalised(attributes.at(attribute))};
  }
  if (!wanted.contains("POSITION")) buffers_.fail(name + ": its Draco data has no positions");
  DracoMesh mesh;
  const std::string_view bytes =
      buffers_.getView(readIndexMember(&extension, "bufferView").value_or(kNoIndex));
  if (const std::string fault = decodeDracoMesh(bytes, wanted, mesh); !fault.empty())
    buffers_.fail(name + ": " + fault);
  std::size_t floats = mesh.indices.size();
  for (const auto& [attribute, values] : mesh.attributes) floats += values.size();
  buffers_.spend(floats * sizeof(float) / kDracoBytesPerByte, 1, name);
  return mesh;
}

const PlainPrimitives::WrittenDraco& PlainPrimitives::writeDraco(const Json& extension,
                                                                 const Json& attributes,
                                                                 const Widths& widths,
                                                                 const TextureMapping& mapping,
                                                                 const std::string& name) {
  const std::string key = extension.dump() + mapping.makeKey() + std::to_string(mapping.set);
  const auto known = writtenDraco_.find(key);
  if (known != writtenDraco_.end()) return known->second;
  DracoMesh mesh = decodeDraco(extension, attributes, widths, name);
  WrittenDraco& to = writtenDraco_[key];
  to.vertices = mesh.attributes.at("POSITION").size() / 3;
  to.indices = binary_.addIndices(mesh.indices);
  for (auto& [attribute, values] : mesh.attributes)
    to.attributes[attribute] =
        writeFloats(attribute, std::move(values), widths.at(attribute), mapping);
  return to;
}

/// assimp leaves out triangles whose indices are out of range, and refuses a file of which a mesh
/// keeps no triangle.
void PlainPrimitives::requireTriangle(const std::vector<std::uint32_t>& corners,
                                      std::size_t vertices, const std::string& name) const {
  const auto exists = [&](std::uint32_t corner) { return corner < vertices; };
  for (auto at = corners.begin(); corners.end() - at >= 3; at += 3)
    if (std::all_of(at, at + 3, exists)) return;
  buffers_.fail(name + (corners.size() < 3
                            ? ": has no whole triangle"
                            : ": each of its triangles has an index beyond its vertices"));
}

void PlainPrimitives::rewriteIndices(Json& primitive, std::size_t vertices,
                                     const std::string& name) {
  const Json stated = primitive.value("mode", Json(kTriangleMode));
  const std::size_t mode = stated.is_number_unsigned() ? stated.get<std::size_t>() : kFanMode + 1;
  if (mode > kFanMode)
    buffers_.fail(name + ": mode " + (stated.is_number() ? stated.dump() : "") + " is not 0 to 6");
  const bool unroll = mode == kStripMode || mode == kFanMode;
  const auto accessor = readIndexMember(&primitive, "indices");
  if (!accessor && primitive.contains("indices"))
    buffers_.fail(name + ": its indices are not an accessor");
  const bool isCut = mode == kTriangleMode && (accessor ? countElements(*accessor) : vertices) % 3;
  if (isCut)
    addDiagnostic(problems_, "broken_triangle_dropped", name + ": its last triangle is incomplete");
  if (!accessor && !unroll && !isCut) return;
  const std::string key =
      (accessor ? std::to_string(*accessor) + " indices of " : std::string("corners of ")) +
      std::to_string(vertices) +
      (unroll  ? " mode " + std::to_string(mode)
       : isCut ? " cut"
               : "");
  auto known = written_.find(key);
  if (known == written_.end()) {
    std::vector<std::uint32_t> indices;
    if (accessor) {
      indices = buffers_.readIndices(*accessor);
    } else {
      indices.resize(vertices);
      std::iota(indices.begin(), indices.end(), 0u);
    }
    if (unroll) indices = unrollTriangles(indices, mode);
    if (isCut) indices.resize(indices.size() - indices.size() % 3);
    if (mode >= kTriangleMode) requireTriangle(indices, vertices, name);
    known = written_.emplace(key, binary_.addIndices(indices)).first;
  }
  primitive["indices"] = known->second;
  if (unroll) primitive["mode"] = kTriangleMode;
}

/// A mesh is readable without its colours. Returns whether the attribute was read.
bool PlainPrimitives::tryAttribute(const std::string& attribute, const std::string& name,
                                   const std::function<void()>& read) {
  if (attribute != kColours) return read(), true;
  try {
    read();
    return true;
  } catch (const UnreadableGltf&) {
    throw;
  } catch (const ImportError& error) {
    addDiagnostic(problems_, "vertex_colours_ignored", name + ": " + error.what());
    return false;
  }
}

void PlainPrimitives::rewrite(Json& primitive, const std::string& name) {
  const Json attributes = primitive.value("attributes", Json::object());
  const auto positions = readIndexMember(&attributes, "POSITION");
  if (!positions) buffers_.fail(name + ": has no positions");
  const TextureMapping mapping =
      readTextureMapping(gltf_, readIndexMember(&primitive, "material").value_or(kNoIndex));
  const Widths widths = listAttributes(attributes, mapping, name);
  Json plain = Json::object();
  std::map<std::string, std::size_t> written;
  const Json* draco = findMember(findMember(&primitive, "extensions"), kDracoExtension);
  if (draco != nullptr) {
    const WrittenDraco& mesh = writeDraco(*draco, attributes, widths, mapping, name);
    written = mesh.attributes;
    primitive["indices"] = mesh.indices;
    primitive["mode"] = kTriangleMode;
  }
  for (const auto& [attribute, width] : widths) {
    if (!written.contains(attribute)) {
      const auto accessor = readIndexMember(&attributes, attribute.c_str());
      if (!accessor) buffers_.fail(name + ": its " + attribute + " is not an accessor");
      const auto write = [&, key = attribute, channels = width] {
        written[key] = writeAttribute(key, *accessor, channels, mapping);
      };
      if (!tryAttribute(attribute, name, write)) continue;
    }
    plain[getPlainName(attribute)] = written[attribute];
  }
  if (draco == nullptr) rewriteIndices(primitive, countElements(*positions), name);
  primitive["attributes"] = std::move(plain);
  for (const char* member : {"targets", "extensions"}) primitive.erase(member);
}

/// The arrays of a primitive, decoded. A Draco mesh gives its indices to the primitive.
PrimitiveArrays PlainPrimitives::readArrays(Json& primitive, const Json& attributes,
                                            const Widths& widths, const std::string& name) {
  PrimitiveArrays arrays;
  const Json* draco = findMember(findMember(&primitive, "extensions"), kDracoExtension);
  if (draco != nullptr) {
    DracoMesh mesh = decodeDraco(*draco, attributes, widths, name);
    arrays = std::move(mesh.attributes);
    primitive["indices"] = binary_.addIndices(mesh.indices);
    primitive["mode"] = kTriangleMode;
  }
  for (const auto& [attribute, width] : widths) {
    if (arrays.contains(attribute)) continue;
    const auto accessor = readIndexMember(&attributes, attribute.c_str());
    if (!accessor) buffers_.fail(name + ": its " + attribute + " is not an accessor");
    tryAttribute(attribute, name, [&, key = attribute, channels = width] {
      arrays[key] = buffers_.readFloats(*accessor, channels, key == kColours);
    });
  }
  if (draco == nullptr) rewriteIndices(primitive, arrays.at("POSITION").size() / 3, name);
  return arrays;
}

void PlainPrimitives::rewritePosed(Json& primitive, const std::string& name, const RestPose& pose) {
  const Json attributes = primitive.value("attributes", Json::object());
  if (!readIndexMember(&attributes, "POSITION")) buffers_.fail(name + ": has no positions");
  const TextureMapping mapping =
      readTextureMapping(gltf_, readIndexMember(&primitive, "material").value_or(kNoIndex));
  const Widths kept = listAttributes(attributes, mapping, name);
  Widths widths = kept;
  if (!pose.nodeFromJoint.empty()) {
    for (const auto& [attribute, accessor] : attributes.items())
      if (attribute.starts_with("JOINTS_") || attribute.starts_with("WEIGHTS_"))
        widths[attribute] = 4;
  }
  PrimitiveArrays arrays = readArrays(primitive, attributes, widths, name);
  applyMorphTargets(pose, primitive.value("targets", Json::array()), buffers_, name, arrays);
  if (!pose.nodeFromJoint.empty()) applySkin(pose, buffers_, name, arrays);
  Json plain = Json::object();
  for (const auto& [attribute, width] : kept) {
    if (!arrays.contains(attribute)) continue;  // colours that cannot be read
    plain[getPlainName(attribute)] =
        writeFloats(attribute, std::move(arrays.at(attribute)), width, mapping);
  }
  primitive["attributes"] = std::move(plain);
  for (const char* member : {"targets", "extensions"}) primitive.erase(member);
}

}  // namespace enfilade::scene
