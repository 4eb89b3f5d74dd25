#include "scene/import/gltf/plain_gltf.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "scene/import/assembly/path_names.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/data_uri.hpp"
#include "scene/import/gltf/encoding/gltf_binary.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/encoding/missing_references.hpp"
#include "scene/import/gltf/encoding/node_graph.hpp"
#include "scene/import/gltf/gltf_buffers.hpp"
#include "scene/import/gltf/gltf_extensions.hpp"
#include "scene/import/gltf/gltf_instances.hpp"
#include "scene/import/gltf/gltf_materials.hpp"
#include "scene/import/gltf/gltf_metadata.hpp"
#include "scene/import/gltf/gltf_rest_pose.hpp"
#include "scene/import/gltf/parse_gltf.hpp"
#include "scene/import/gltf/plain_check.hpp"
#include "scene/import/gltf/plain_primitives.hpp"
#include "scene/import/gltf/unreadable_mesh.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// The JSON text of a file. Old exporters write names in the encoding of their computer; bytes
/// that are not UTF-8 are reported.
std::string readMendedJson(const std::filesystem::path& file, ModelFormat format,
                           std::vector<Diagnostic>& problems) {
  std::string text = readGltfJson(file, format);
  const std::size_t decoded = decodeOtherBytes(text);
  addDiagnostic(problems, "mended_text", "read bytes that are not UTF-8 as Windows-1252", decoded);
  return text;
}

/// glTF 1.0 has dictionaries where 2.0 has arrays.
void requireVersion2(const Json& gltf, const std::filesystem::path& file) {
  const Json* asset = findMember(&gltf, "asset");
  const Json* version = findMember(asset, "version");
  if ((asset != nullptr && !asset->is_object()) || (version != nullptr && !version->is_string()))
    failJson(file, "states no glTF version");
  const bool isOld = version != nullptr && !version->get_ref<const std::string&>().starts_with("2");
  const Json* minimum = findMember(asset, "minVersion");
  if (minimum != nullptr && minimum->is_string() && *minimum != "2.0")
    throw ImportError(file.string() + ": needs a reader of glTF " + minimum->get<std::string>() +
                      "; export it as glTF 2.0");
  const Json* meshes = findMember(&gltf, "meshes");
  if (!isOld && (meshes == nullptr || !meshes->is_object())) return;
  throw ImportError(file.string() + ": glTF version " +
                    (isOld ? version->get<std::string>() : "1.0") +
                    " cannot be read; export it as glTF 2.0");
}

// ---- rewriting ----------------------------------------------------------------------------------

/// Rewrites the primitives of a file one by one. One that cannot be read is replaced or removed.
class MeshRewriter {
 public:
  MeshRewriter(const Json& original, GltfBuffers& buffers, GltfBinary& binary,
               std::vector<Diagnostic>& problems)
      : original_(original),
        buffers_(buffers),
        binary_(binary),
        problems_(problems),
        primitives_(original, buffers, binary, problems) {}

  /// `pose`: null for the pose of the file's vertices.
  void rewrite(Json& mesh, const std::string& name, const RestPose* pose) {
    readAny_ = false;
    Json kept = Json::array();
    if (!mesh.is_object() || getArray(mesh, "primitives").empty())
      addDiagnostic(problems_, "missing_mesh", name + " has no primitives");
    if (!mesh.is_object()) mesh = Json::object();
    for (std::size_t p = 0; p < getArray(mesh, "primitives").size(); ++p) {
      Json primitive = rewritePrimitive(mesh["primitives"][p],
                                        name + ".primitives[" + std::to_string(p) + "]", pose);
      if (!primitive.is_null()) kept.push_back(std::move(primitive));
    }
    mesh["primitives"] = std::move(kept);
    mesh.erase("weights");
  }

  /// Whether any primitive of the last mesh could be read.
  bool readAny() const { return readAny_; }
  const std::string& firstError() const { return firstError_; }

 private:
  Json rewritePrimitive(Json& primitive, const std::string& place, const RestPose* pose) {
    dropMissingMaterial(primitive, place);
    const Json original = primitive;
    const bool hasFallback = hasPlainData(original);
    const std::vector<Diagnostic> before = hasFallback ? problems_ : std::vector<Diagnostic>();
    std::string fault = tryToRewrite(primitive, place, pose);
    if (!fault.empty() && hasFallback) {
      primitive = original;
      primitive["extensions"].erase(kDracoExtension);
      problems_ = before;
      if (tryToRewrite(primitive, place, pose).empty()) {
        addDiagnostic(problems_, "plain_data_used", fault);
        fault.clear();
      } else {
        problems_ = before;
      }
    }
    if (fault.empty()) {
      readAny_ = true;
      return std::move(primitive);
    }
    if (firstError_.empty()) firstError_ = fault;
    return replaceUnreadable({original, pose, fault}, getArray(original_, "accessors"), buffers_,
                             binary_, problems_);
  }

  /// Returns the reason why it cannot be read; "" for none.
  std::string tryToRewrite(Json& primitive, const std::string& place, const RestPose* pose) {
    std::string fault;
    try {
      if (pose != nullptr) {
        primitives_.rewritePosed(primitive, place, *pose);
      } else {
        primitives_.rewrite(primitive, place);
      }
    } catch (const UnreadableGltf&) {
      throw;
    } catch (const ImportError& error) {
      fault = error.what();
    } catch (const Json::exception& error) {
      fault = std::string("its JSON is not valid glTF: ") + error.what() + "; export it again";
    }
    return fault.empty() || fault.find(place) != std::string::npos ? fault : place + ": " + fault;
  }

  /// Whether a Draco primitive has all its data without compression, too. An accessor without a
  /// buffer view is all zeros.
  bool hasPlainData(const Json& primitive) const {
    if (findMember(findMember(&primitive, "extensions"), kDracoExtension) == nullptr) return false;
    const auto isStored = [this](const Json& accessor) {
      return findMember(findEntry(getArray(original_, "accessors"), &accessor), "bufferView") !=
             nullptr;
    };
    const Json* attributes = findMember(&primitive, "attributes");
    const Json* indices = findMember(&primitive, "indices");
    return attributes != nullptr && attributes->is_object() &&
           std::all_of(attributes->begin(), attributes->end(), isStored) &&
           (indices == nullptr || isStored(*indices));
  }

  void dropMissingMaterial(Json& primitive, const std::string& place) {
    const Json* material = findMember(&primitive, "material");
    if (material == nullptr || findEntry(getArray(original_, "materials"), material) != nullptr)
      return;
    primitive.erase("material");
    addDiagnostic(problems_, "missing_material", place);
  }

  const Json& original_;
  GltfBuffers& buffers_;
  GltfBinary& binary_;
  std::vector<Diagnostic>& problems_;
  PlainPrimitives primitives_;
  bool readAny_ = false;
  std::string firstError_;
};

/// See PlainGltf::meshes.
std::vector<std::size_t> listMeshes(const GltfNodeTree& tree, std::size_t meshCount) {
  std::vector<bool> isListed(meshCount, false);
  std::vector<std::size_t> meshes;
  for (const std::size_t index : listSceneNodes(tree)) {
    const std::optional<std::size_t>& mesh = tree.nodes[index].mesh;
    if (!mesh || *mesh >= meshCount || isListed[*mesh]) continue;
    isListed[*mesh] = true;
    meshes.push_back(*mesh);
  }
  return meshes;
}

/// Problems of meshes that the scene does not use are not reported. Throws ImportError if none that
/// it uses can be read.
void rewriteMeshes(Json& gltf, const GltfNodeTree& tree,
                   const std::map<std::size_t, RestPose>& poses, GltfBuffers& buffers,
                   GltfBinary& binary, std::vector<Diagnostic>& problems) {
  const Json original{{"accessors", getArray(gltf, "accessors")},
                      {"materials", getArray(gltf, "materials")}};
  MeshRewriter rewriter(original, buffers, binary, problems);
  const auto meshes = gltf.find("meshes");
  if (meshes == gltf.end() || !meshes->is_array()) return;
  std::vector<bool> isUsed(meshes->size(), false);
  for (const std::size_t mesh : listMeshes(tree, meshes->size())) isUsed[mesh] = true;
  bool readAny = false;
  for (std::size_t m = 0; m < meshes->size(); ++m) {
    const auto pose = poses.find(m);
    const RestPose* const own = pose == poses.end() ? nullptr : &pose->second;
    const std::size_t number = own == nullptr ? m : own->mesh;
    std::vector<Diagnostic> before;
    if (!isUsed[m]) before = problems;
    rewriter.rewrite((*meshes)[m], "meshes[" + std::to_string(number) + "]", own);
    if (!isUsed[m]) problems = std::move(before);
    readAny = readAny || (rewriter.readAny() && isUsed[m]);
  }
  if (!readAny && !rewriter.firstError().empty()) throw ImportError(rewriter.firstError());
}

constexpr std::string_view kNoImage = "none";  // bytes in place of an image that cannot be read

/// Copies images that lie in buffers.
void rewriteImages(Json& gltf, GltfBuffers& buffers, GltfBinary& binary) {
  const auto images = gltf.find("images");
  if (images == gltf.end() || !images->is_array()) return;
  for (Json& image : *images) {
    const auto view = readIndexMember(&image, "bufferView");
    const Json* uri = findMember(&image, "uri");
    if (uri != nullptr && uri->is_string() && isDataUri(uri->get_ref<const std::string&>()))
      image["uri"] = lowerDataUri(uri->get<std::string>());
    if (!view) continue;
    std::string_view bytes;
    try {
      bytes = buffers.getView(*view);
    } catch (const UnreadableGltf&) {
      throw;
    } catch (const ImportError&) {
      // Its texture is reported as unreadable.
      bytes = kNoImage;
    }
    buffers.spend(bytes.size(), 1, "an image");
    image["bufferView"] = binary.addView(bytes);
  }
}

void removeReadExtensions(Json& gltf) {
  const auto used = gltf.find("extensionsUsed");
  if (used == gltf.end() || !used->is_array()) return;
  Json kept = Json::array();
  for (const Json& name : *used) {
    const bool read = name.is_string() && isRewrittenExtension(name.get<std::string>());
    if (!read) kept.push_back(name);
  }
  *used = std::move(kept);
}

/// A file need not have scenes: all nodes that are no child then form one.
void addMissingScene(Json& gltf, const std::filesystem::path& file) {
  if (!getArray(gltf, "scenes").empty()) return;
  const Json& nodes = getArray(gltf, "nodes");
  std::vector<bool> isChild(nodes.size());
  for (const Json& node : nodes)
    for (const Json& child : getArray(node, "children"))
      if (findEntry(nodes, &child) != nullptr) isChild[child.get<std::size_t>()] = true;
  Json roots = Json::array();
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (!isChild[i]) roots.push_back(i);
  if (roots.empty())
    throw ImportError(file.string() + ": has neither a scene nor a root node; export it with one");
  gltf["scenes"] = Json::array({{{"nodes", std::move(roots)}}});
}

/// Reads the scene's root nodes.
GltfNodeTree makeTree(std::vector<PlainNode> nodes, const Json& sections, std::uint32_t scene) {
  GltfNodeTree tree{std::move(nodes), {}};
  const Json& scenes = getArray(sections, "scenes");
  if (scene < scenes.size()) tree.roots = readIndices(scenes[scene], "nodes");
  return tree;
}

void rewriteGltf(const std::filesystem::path& file, ModelFormat format, PlainGltf& to) {
  const Json original = Json::parse(to.json);
  GltfBuffers buffers(file, format, original);
  GltfBinary binary;
  Json gltf = original;
  addMissingScene(gltf, file);
  try {
    dropMissingReferences(gltf, to.problems);
    replaceSpecularGlossiness(gltf);
    // Instances are copies of the posed mesh, so all instances of a node share one.
    const auto poses = separatePosedMeshes(gltf, buffers, to.problems);
    expandInstances(gltf, buffers, to.problems);
    dropMissingTextures(gltf, to.problems);
    std::vector<PlainNode> nodes;
    for (const Json& node : getArray(gltf, "nodes")) nodes.push_back(readPlainNode(node));
    to.tree = makeTree(std::move(nodes), gltf, to.scene);
    rewriteMeshes(gltf, to.tree, poses, buffers, binary, to.problems);
    rewriteImages(gltf, buffers, binary);
    simplifyMaterials(gltf);
    removeReadExtensions(gltf);
    binary.install(gltf);
  } catch (const Json::exception& error) {
    buffers.fail(std::string("its JSON is not valid glTF: ") + error.what());
  }
  // Names that are not UTF-8 would make dump() throw.
  to.json = gltf.dump(-1, ' ', false, Json::error_handler_t::replace);
  to.dependencies = buffers.dependencies();
  to.isRewritten = true;
  to.binary = std::move(binary);
  gltf.erase("nodes");
  to.sections = std::move(gltf);
}

/// The JSON of a GltfMeshFile.
std::string writeMeshJson(Json sections, const std::vector<std::size_t>& meshes) {
  Json json = Json::object();
  for (const char* section : {"asset", "extensionsUsed", "meshes", "accessors", "bufferViews",
                              "buffers", "materials", "textures", "images", "samplers"})
    if (const auto found = sections.find(section); found != sections.end())
      json[section] = std::move(*found);
  Json children = Json::array(), nodes = Json::array({Json::object()});
  for (const std::size_t mesh : meshes) {
    children.push_back(nodes.size());
    nodes.push_back({{"mesh", mesh}});
  }
  nodes[0]["children"] = std::move(children);
  json["nodes"] = std::move(nodes);
  json["scenes"] = Json::array({{{"nodes", Json::array({0u})}}});
  json["scene"] = 0u;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

// ---- scenes -------------------------------------------------------------------------------------

std::string listScenes(const std::vector<std::string>& scenes) {
  constexpr std::size_t kMaxListed = 20;
  std::string text;
  for (std::size_t i = 0; i < scenes.size() && i < kMaxListed; ++i)
    text +=
        (i > 0 ? ", " : "") + std::to_string(i) + (scenes[i].empty() ? "" : " '" + scenes[i] + "'");
  return text + (scenes.size() > kMaxListed ? ", .." : "");
}

/// The scene that `choice` names or numbers. A name takes precedence over a number.
std::uint32_t findScene(const std::vector<std::string>& scenes, const std::string& choice,
                        const std::filesystem::path& file) {
  const auto named = std::find(scenes.begin(), scenes.end(), choice);
  if (named != scenes.end()) return static_cast<std::uint32_t>(named - scenes.begin());
  for (std::size_t i = 0; i < scenes.size(); ++i)
    if (choice == std::to_string(i)) return static_cast<std::uint32_t>(i);
  throw ImportError(file.string() + ": no scene '" + choice + "'; its scenes are " +
                    listScenes(scenes));
}

/// Reads the scenes of a file and chooses one. Returns whether it is not the file's default.
bool chooseScene(const Json& sections, const std::string& choice, const std::filesystem::path& file,
                 PlainGltf& to) {
  for (const Json& scene : getArray(sections, "scenes")) {
    const Json* name = findMember(&scene, "name");
    to.scenes.push_back(name != nullptr && name->is_string() ? name->get<std::string>() : "");
  }
  if (to.scenes.empty()) {
    if (!choice.empty() && choice != "0")
      throw ImportError(file.string() + ": no scene '" + choice +
                        "'; it has no scenes, and all its nodes are read");
    to.scenes.emplace_back();
    to.problems.push_back({"no_scene", 1, "all root nodes were read"});
    return true;
  }
  const std::size_t standard = readIndexMember(&sections, "scene").value_or(0);
  if (choice.empty() && standard >= to.scenes.size())
    throw ImportError(file.string() + ": its default scene " + std::to_string(standard) +
                      " is missing; choose one by --gltf-scene: " + listScenes(to.scenes));
  to.scene =
      choice.empty() ? static_cast<std::uint32_t>(standard) : findScene(to.scenes, choice, file);
  if (to.scenes.size() > 1)
    to.problems.push_back(
        {"other_scenes", to.scenes.size() - 1,
         "scene " + std::to_string(to.scene) + " was read" +
             (choice.empty() && sections.contains("scene") ? ", which is the file's default" : "") +
             ", of " + listScenes(to.scenes)});
  return to.scene != standard;
}

}  // namespace

PlainGltf makePlainGltf(const std::filesystem::path& file, ModelFormat format,
                        const GltfChoice& choice) {
  PlainGltf plain;
  std::vector<Diagnostic> problems;
  plain.json = readMendedJson(file, format, problems);
  ParsedGltf parsed = parseGltf(plain.json, file);
  const std::size_t duplicates = parsed.duplicates.count();
  addDiagnostic(problems, "duplicate_key", parsed.duplicates.firstPath(), duplicates);
  requireVersion2(parsed.sections, file);
  if (parsed.hasWrongNodes) failJson(file, "has no list of nodes");
  plain.problems =
      checkGltfExtensions(parsed.sections, parsed.extensions, file, choice.ignoreAppearance);
  plain.problems.insert(plain.problems.end(), problems.begin(), problems.end());
  const bool other = chooseScene(parsed.sections, choice.scene, file, plain);
  plain.tree = makeTree(std::move(parsed.nodes), parsed.sections, plain.scene);
  plain.sections = std::move(parsed.sections);
  // Rewriting leaves one value of a duplicate key, so that assimp reads the one checked here.
  if (other || choice.rewrite || duplicates > 0 ||
      hasMissingReferences(plain.tree, plain.sections) ||
      needsRewriting(plain.json, plain.sections, file, format))
    rewriteGltf(file, format, plain);
  const std::vector<std::size_t> triangles = countTrianglesByMesh(plain.sections);
  validateNodeGraph(plain.tree, triangles, file);
  plain.meshes = listMeshes(plain.tree, triangles.size());
  for (const std::size_t mesh : plain.meshes) plain.triangles += triangles[mesh];
  return plain;
}

GltfMeshFile takeMeshFile(PlainGltf& plain, const std::filesystem::path& file, ModelFormat format) {
  std::string json = writeMeshJson(std::move(plain.sections), plain.meshes);
  if (!plain.isRewritten && format == ModelFormat::gltf) return {std::move(json)};
  GltfMeshFile made;
  if (plain.isRewritten) {
    made.start = std::exchange(plain.binary, {}).makeGlb(std::move(json));
  } else if (const GlbBinary rest = findGlbBinary(file); rest.size > 0) {
    made.restAt = rest.chunkAt;
    made.restBytes = kGlbChunkHeader + rest.size;
  }
  if (!plain.isRewritten) made.start = makeGlbStart(std::move(json), made.restBytes);
  if (made.start.empty())
    throw ImportError(file.string() + ": its meshes exceed the 4 GiB of a GLB file; split it");
  return made;
}

}  // namespace enfilade::scene
