#include "assets/glb_writer.hpp"

#include <bit>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace enfilade::assets {
namespace {

using Json = nlohmann::ordered_json;
static_assert(std::endian::native == std::endian::little, "GLB is little-endian");

constexpr int kFloat = 5126, kUint16 = 5123, kUint32 = 5125;
constexpr int kArrayBuffer = 34962, kElementArrayBuffer = 34963;
constexpr std::uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinChunk = 0x004E4942;

/// A float as the shortest decimal that reads back as the same float.
Json makeShortestNumber(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", static_cast<double>(value));
  if (std::strtof(text, nullptr) != value)
    std::snprintf(text, sizeof text, "%.9g", static_cast<double>(value));
  return std::strtod(text, nullptr);
}

Json makeMaterialJson(const scene::Material& m) {
  Json json{{"name", m.name}};
  Json pbr;
  for (int i = 0; i < 4; ++i) pbr["baseColorFactor"].push_back(makeShortestNumber(m.baseColour[i]));
  pbr["metallicFactor"] = makeShortestNumber(m.metallic);
  pbr["roughnessFactor"] = makeShortestNumber(m.roughness);
  json["pbrMetallicRoughness"] = pbr;
  if (m.emissive != Eigen::Vector3f::Zero())
    for (int i = 0; i < 3; ++i) json["emissiveFactor"].push_back(makeShortestNumber(m.emissive[i]));
  if (m.alpha == scene::Material::Alpha::blend) json["alphaMode"] = "BLEND";
  if (m.alpha == scene::Material::Alpha::mask) {
    json["alphaMode"] = "MASK";
    json["alphaCutoff"] = makeShortestNumber(m.alphaCutoff);
  }
  if (m.doubleSided) json["doubleSided"] = true;
  return json;
}

/// The binary chunk and the JSON that describes its content.
struct Buffer {
  std::string bytes;
  Json views = Json::array();
  Json accessors = Json::array();

  std::size_t add(const void* data, std::size_t size, int target, Json accessor) {
    while (bytes.size() % 4) bytes.push_back('\0');
    views.push_back(
        {{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", size}, {"target", target}});
    bytes.append(static_cast<const char*>(data), size);
    accessor["bufferView"] = views.size() - 1;
    accessors.push_back(std::move(accessor));
    return accessors.size() - 1;
  }
};

std::size_t addVectors(Buffer& buffer, const std::vector<Eigen::Vector3f>& vectors, bool bounds) {
  static_assert(sizeof(Eigen::Vector3f) == 12);
  Json accessor{{"componentType", kFloat}, {"count", vectors.size()}, {"type", "VEC3"}};
  if (bounds) {
    Eigen::Vector3f low = vectors.front(), high = low;
    for (const Eigen::Vector3f& v : vectors) {
      low = low.cwiseMin(v);
      high = high.cwiseMax(v);
    }
    for (int i = 0; i < 3; ++i) {
      accessor["min"].push_back(makeShortestNumber(low[i]));
      accessor["max"].push_back(makeShortestNumber(high[i]));
    }
  }
  return buffer.add(vectors.data(), vectors.size() * 12, kArrayBuffer, std::move(accessor));
}

std::size_t addIndices(Buffer& buffer, const scene::Mesh& mesh) {
  const std::vector<std::uint32_t>& indices = mesh.indices;
  const bool narrow = mesh.positions.size() < 65535;  // 65535 itself means "restart"
  const Json accessor{
      {"componentType", narrow ? kUint16 : kUint32}, {"count", indices.size()}, {"type", "SCALAR"}};
  if (!narrow) return buffer.add(indices.data(), indices.size() * 4, kElementArrayBuffer, accessor);
  std::vector<std::uint16_t> shorts;
  for (std::uint32_t i : indices) shorts.push_back(static_cast<std::uint16_t>(i));
  return buffer.add(shorts.data(), shorts.size() * 2, kElementArrayBuffer, accessor);
}

std::vector<Json> makePrimitives(const scene::Model& model, Buffer& buffer) {
  std::vector<Json> primitives;
  for (const scene::Mesh& mesh : model.meshes) {
    if (mesh.positions.empty() || mesh.indices.empty())
      throw std::invalid_argument("mesh '" + mesh.name + "': GLB has no empty meshes");
    Json attributes{{"POSITION", addVectors(buffer, mesh.positions, true)}};
    if (!mesh.normals.empty()) attributes["NORMAL"] = addVectors(buffer, mesh.normals, false);
    primitives.push_back({{"attributes", attributes},
                          {"indices", addIndices(buffer, mesh)},
                          {"material", mesh.material}});
  }
  return primitives;
}

/// A glTF mesh is a set of our meshes (as its primitives): one for each set that an object uses.
struct MeshTable {
  Json meshes = Json::array();
  std::map<std::vector<std::uint32_t>, std::size_t> index;
};

MeshTable makeMeshTable(const scene::Model& model, const std::vector<Json>& primitives) {
  MeshTable table;
  for (const scene::Object& object : model.objects) {
    if (object.meshes.empty())
      throw std::invalid_argument("object '" + object.path + "' has no meshes");
    if (!table.index.emplace(object.meshes, table.meshes.size()).second) continue;
    Json json{{"name", model.meshes[object.meshes.front()].name}};
    for (std::uint32_t mesh : object.meshes) json["primitives"].push_back(primitives[mesh]);
    table.meshes.push_back(std::move(json));
  }
  return table;
}

/// A node of the path tree: an object, a group of them, or both.
struct Node {
  std::string name;
  std::int64_t object = -1;
  std::vector<std::uint32_t> children;
};

struct PathTree {
  std::vector<Node> nodes;
  std::vector<std::uint32_t> roots;
};

PathTree makePathTree(const scene::Model& model) {
  PathTree tree;
  std::map<std::string, std::uint32_t, std::less<>> byPath;
  const auto findOrAddNode = [&](auto& self, const std::string& path) -> std::uint32_t {
    if (const auto found = byPath.find(path); found != byPath.end()) return found->second;
    const std::size_t slash = path.rfind('/');
    const bool isRoot = slash == std::string::npos;
    const std::uint32_t parent = isRoot ? 0 : self(self, path.substr(0, slash));
    const auto index = static_cast<std::uint32_t>(tree.nodes.size());
    tree.nodes.push_back({path.substr(isRoot ? 0 : slash + 1), -1, {}});
    (isRoot ? tree.roots : tree.nodes[parent].children).push_back(index);
    byPath.emplace(path, index);
    return index;
  };
  for (std::size_t i = 0; i < model.objects.size(); ++i) {
    Node& node = tree.nodes[findOrAddNode(findOrAddNode, model.objects[i].path)];
    if (node.object >= 0)
      throw std::invalid_argument("two objects with the path '" + model.objects[i].path + "'");
    node.object = static_cast<std::int64_t>(i);
  }
  return tree;
}

/// The frame of each node is that of its nearest ancestor object, or the scene's.
std::vector<std::int64_t> findAncestorObjects(const PathTree& tree) {
  std::vector<std::int64_t> ancestors(tree.nodes.size(), -1);
  for (std::size_t i = 0; i < tree.nodes.size(); ++i)  // parents come before their children
    for (std::uint32_t child : tree.nodes[i].children)
      ancestors[child] = tree.nodes[i].object >= 0 ? tree.nodes[i].object : ancestors[i];
  return ancestors;
}

void addTransform(Json& json, const Eigen::Affine3d& t) {
  if (t.linear() != Eigen::Matrix3d::Identity()) {
    Json& matrix = json["matrix"];
    const Eigen::Matrix4d m = t.matrix();
    for (int column = 0; column < 4; ++column)
      for (int row = 0; row < 4; ++row) matrix.push_back(m(row, column) + 0.0);
  } else if (t.translation() != collision::Vec3::Zero()) {
    const collision::Vec3& v = t.translation();
    json["translation"] = {v.x() + 0.0, v.y() + 0.0, v.z() + 0.0};
  }
}

Json makeMotionJson(const MovingPart& part) {
  const bool turns = part.kind == MovingPart::Kind::hinge;
  if (part.isLift())  // as in the sidecar, which has its doors, too
    return {{"walk_kind", "lift"},
            {"walk_stops", {part.low, part.high}},
            {"walk_speed", kLiftSpeed},
            {"walk_acceleration", kLiftAcceleration}};
  const double scale = turns ? 57.29577951308232 : 1;  // degrees per radian
  return {{"walk_kind", turns ? "hinged" : "sliding"},
          {"walk_axis", {part.axis.x(), part.axis.y(), part.axis.z()}},
          {"walk_limits", {scale * part.low, scale * part.high}}};
}

/// Writes the nodes as text one by one: a district's would not fit in memory as JSON values.
std::string formatNodes(const scene::Model& model, const std::vector<MovingPart>& movingParts,
                        const PathTree& tree, const MeshTable& meshes) {
  std::map<std::int64_t, Json> extras;
  for (const MovingPart& part : movingParts) extras[part.object] = makeMotionJson(part);
  const std::vector<std::int64_t> ancestors = findAncestorObjects(tree);
  std::string text;
  for (std::size_t i = 0; i < tree.nodes.size(); ++i) {
    const Node& node = tree.nodes[i];
    Json json{{"name", node.name}};
    if (node.object >= 0) {
      const scene::Object& object = model.objects[static_cast<std::size_t>(node.object)];
      json["mesh"] = meshes.index.at(object.meshes);
      Eigen::Affine3d place = object.worldFromMesh;
      if (ancestors[i] >= 0)
        place =
            model.objects[static_cast<std::size_t>(ancestors[i])].worldFromMesh.inverse() * place;
      addTransform(json, place);
      if (const auto found = extras.find(node.object); found != extras.end())
        json["extras"] = found->second;
    }
    if (!node.children.empty()) json["children"] = node.children;
    text += (i ? "," : "") + json.dump();
  }
  return text;
}

std::string formatJson(const scene::Model& model, const std::vector<MovingPart>& movingParts,
                       Buffer& buffer) {
  const PathTree tree = makePathTree(model);
  const MeshTable meshes = makeMeshTable(model, makePrimitives(model, buffer));
  Json json{{"asset", {{"version", "2.0"}, {"generator", "enfilade make_building"}}},
            {"scene", 0},
            {"scenes", {{{"name", model.source}, {"nodes", tree.roots}}}}};
  for (const scene::Material& m : model.materials) json["materials"].push_back(makeMaterialJson(m));
  json["meshes"] = meshes.meshes;
  json["accessors"] = buffer.accessors;
  json["bufferViews"] = buffer.views;
  json["buffers"] = {{{"byteLength", buffer.bytes.size()}}};
  std::string text = json.dump();
  text.pop_back();
  return text + ",\"nodes\":[" + formatNodes(model, movingParts, tree, meshes) + "]}";
}

void appendWord(std::string& bytes, std::size_t value) {
  const auto word = static_cast<std::uint32_t>(value);
  char raw[4];
  std::memcpy(raw, &word, 4);
  bytes.append(raw, 4);
}

}  // namespace

std::string encodeGlb(const scene::Model& model, const std::vector<MovingPart>& movingParts) {
  if (model.objects.empty()) throw std::invalid_argument("a GLB needs at least one object");
  Buffer buffer;
  std::string json = formatJson(model, movingParts, buffer);
  while (json.size() % 4) json.push_back(' ');
  while (buffer.bytes.size() % 4) buffer.bytes.push_back('\0');
  const std::size_t total = 12 + 8 + json.size() + 8 + buffer.bytes.size();
  if (total > std::numeric_limits<std::uint32_t>::max())
    throw std::length_error("GLB holds at most 4 GiB, this model needs " + std::to_string(total) +
                            " bytes: use fewer objects");
  std::string glb;
  glb.reserve(total);
  appendWord(glb, kMagic);
  appendWord(glb, 2);
  appendWord(glb, total);
  appendWord(glb, json.size());
  appendWord(glb, kJsonChunk);
  glb += json;
  appendWord(glb, buffer.bytes.size());
  appendWord(glb, kBinChunk);
  glb += buffer.bytes;
  return glb;
}

void writeGlb(const std::filesystem::path& file, const scene::Model& model,
              const std::vector<MovingPart>& movingParts) {
  const std::string bytes = encodeGlb(model, movingParts);
  // Written to a temporary name and renamed, so that a file with the final name is complete.
  const std::filesystem::path part = file.string() + ".part";
  std::ofstream out(part, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out)
    throw std::runtime_error("cannot write " + part.string() + ": " + std::strerror(errno) +
                             ": check that the folder exists and the disk has space");
  std::filesystem::rename(part, file);
}

}  // namespace enfilade::assets
