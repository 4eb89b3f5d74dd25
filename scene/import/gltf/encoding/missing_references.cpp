#include "scene/import/gltf/encoding/missing_references.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <utility>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

/// A member of nodes that is an index into a section of the file.
struct Reference {
  const char *member, *section, *diagnostic;
};
constexpr std::array<Reference, 3> kReferences{{{"mesh", "meshes", "missing_mesh"},
                                                {"camera", "cameras", "missing_camera"},
                                                {"skin", "skins", "skin_ignored"}}};

std::string describeMissing(const char* kind, const Json& index) {
  return std::string(": ") + kind +
         (index.is_number_integer() ? " " + index.dump() + " does not exist" : " is not an index");
}

void dropMissingMembers(Json& node, std::size_t number, const Json& gltf,
                        std::vector<Diagnostic>& problems) {
  for (const auto& [member, section, diagnostic] : kReferences) {
    const Json* index = findMember(&node, member);
    if (index == nullptr || findEntry(getArray(gltf, section), index) != nullptr) continue;
    const std::string fault =
        describeEntry("nodes", number, readEntryName(node)) + describeMissing(member, *index);
    addDiagnostic(problems, diagnostic, fault);
    node.erase(member);
  }
}

/// `key`: a member of `owner` that is a list of nodes.
void dropMissingNodes(Json& owner, const char* key, const std::string& name, const Json& nodes,
                      std::vector<Diagnostic>& problems) {
  const Json* stated = findMember(&owner, key);
  if (stated == nullptr) return;
  if (!stated->is_array()) {
    addDiagnostic(problems, "missing_node", name + ": \"" + key + "\" is not a list");
    owner.erase(key);
    return;
  }
  Json kept = Json::array();
  for (const Json& index : getArray(owner, key)) {
    if (findEntry(nodes, &index) != nullptr) {
      kept.push_back(index);
    } else {
      addDiagnostic(problems, "missing_node", name + describeMissing("node", index));
    }
  }
  if (kept.size() < getArray(owner, key).size()) owner[key] = std::move(kept);
}

}  // namespace

bool hasMissingReferences(const GltfNodeTree& tree, const Json& sections) {
  const std::size_t meshes = getArray(sections, "meshes").size();
  const std::size_t cameras = getArray(sections, "cameras").size();
  const auto isMissing = [&](std::size_t node) { return node >= tree.nodes.size(); };
  const std::vector<std::size_t> scene = listSceneNodes(tree);
  return std::ranges::any_of(tree.roots, isMissing) ||
         std::ranges::any_of(scene, [&](std::size_t index) {
           const PlainNode& node = tree.nodes[index];
           return (node.mesh && *node.mesh >= meshes) || (node.camera && *node.camera >= cameras) ||
                  std::ranges::any_of(node.children, isMissing);
         });
}

void dropMissingReferences(Json& gltf, std::vector<Diagnostic>& problems) {
  const Json& nodes = getArray(gltf, "nodes");
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    Json& node = gltf["nodes"][i];
    if (!node.is_object()) continue;
    dropMissingNodes(node, "children", describeEntry("nodes", i, readEntryName(node)), nodes,
                     problems);
    dropMissingMembers(node, i, gltf, problems);
  }
  for (std::size_t i = 0; i < getArray(gltf, "scenes").size(); ++i) {
    Json& scene = gltf["scenes"][i];
    if (scene.is_object())
      dropMissingNodes(scene, "nodes", describeEntry("scenes", i, readEntryName(scene)), nodes,
                       problems);
  }
}

}  // namespace enfilade::scene
