#include "scene/import/gltf/gltf_instances.hpp"

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";
constexpr std::size_t kNodeBytes = 1000;  // of an instance's JSON in memory, roughly

/// One attribute of all instances of a node.
struct InstanceAttribute {
  const char* name;      ///< in the extension
  const char* property;  ///< of a node
  std::size_t width;
  std::vector<float> values = {};
};

/// Instances of one node.
class InstancedNode {
 public:
  InstancedNode(const Json& attributes, GltfBuffers& buffers, const std::string& name)
      : buffers_(buffers), name_(name) {
    for (InstanceAttribute& attribute : attributes_) {
      const Json* accessor = findMember(&attributes, attribute.name);
      if (accessor == nullptr) continue;
      if (!accessor->is_number_unsigned())
        buffers_.fail(name_ + ": its instances' " + attribute.name + " is not an accessor");
      attribute.values = buffers_.readFloats(accessor->get<std::size_t>(), attribute.width);
      setCount(attribute.values.size() / attribute.width);
    }
    if (!count_)
      buffers_.fail(name_ + ": its instances have no transform, so their count is unknown");
    buffers_.spend(*count_, kNodeBytes, name_);
  }

  std::size_t count() const { return *count_; }

  Json makeNode(std::size_t instance, const Json& mesh) const {
    Json node{{"name", name_ + "[" + std::to_string(instance) + "]"}, {"mesh", mesh}};
    for (const InstanceAttribute& attribute : attributes_) {
      if (attribute.values.empty()) continue;
      Json& numbers = node[attribute.property] = Json::array();
      for (std::size_t i = 0; i < attribute.width; ++i) {
        const float value = attribute.values[instance * attribute.width + i];
        if (!std::isfinite(value))
          buffers_.fail(name_ + ": the transform of instance " + std::to_string(instance) +
                        " is not finite");
        numbers.push_back(static_cast<double>(value));
      }
    }
    return node;
  }

 private:
  void setCount(std::size_t count) {
    if (count_.value_or(count) != count)
      buffers_.fail(name_ + ": the attributes of its instances differ in length");
    count_ = count;
  }

  GltfBuffers& buffers_;
  std::string name_;
  std::optional<std::size_t> count_;
  std::array<InstanceAttribute, 3> attributes_{
      {{"TRANSLATION", "translation", 3}, {"ROTATION", "rotation", 4}, {"SCALE", "scale", 3}}};
};

std::string getNodeName(const Json& node) {
  const Json* name = findMember(&node, "name");
  return name != nullptr && name->is_string() && !name->get_ref<const std::string&>().empty()
             ? name->get<std::string>()
             : "node";
}

/// Expands one node; `added` are the new nodes, whose first index is `next`.
void expandNode(Json& node, std::size_t next, GltfBuffers& buffers, Json& added,
                std::vector<Diagnostic>& problems) {
  const Json* extension = findMember(findMember(&node, "extensions"), kInstancing);
  if (extension == nullptr || !node.contains("mesh")) return;
  const Json* attributes = findMember(extension, "attributes");
  const std::string name = getNodeName(node);
  if (attributes == nullptr || !attributes->is_object())
    buffers.fail(name + ": its instances have no attributes");
  for (const auto& [key, accessor] : attributes->items()) {
    if (key.starts_with("_"))
      addDiagnostic(problems, "instance_attributes_ignored", name + ": " + key);
  }
  const InstancedNode instances(*attributes, buffers, name);
  Json& children = node["children"];
  if (!children.is_array()) children = Json::array();
  for (std::size_t i = 0; i < instances.count(); ++i) {
    children.push_back(next + added.size());
    added.push_back(instances.makeNode(i, node["mesh"]));
  }
  node.erase("mesh");
  node["extensions"].erase(kInstancing);
}

}  // namespace

void expandInstances(Json& gltf, GltfBuffers& buffers, std::vector<Diagnostic>& problems) {
  const auto nodes = gltf.find("nodes");
  if (nodes == gltf.end() || !nodes->is_array()) return;
  Json added = Json::array();
  for (Json& node : *nodes) {
    if (node.is_object()) expandNode(node, nodes->size(), buffers, added, problems);
  }
  for (Json& node : added) nodes->push_back(std::move(node));
}

}  // namespace enfilade::scene
