#include "scene/import/gltf/gltf_instances.hpp"

#include <algorithm>
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
// Of JSON in memory, roughly: an instance, one of its own attributes, and a number of that.
constexpr std::size_t kNodeBytes = 1000, kAttributeBytes = 100, kNumberBytes = 16;

/// One attribute of all instances of a node.
struct InstanceAttribute {
  const char* name;      ///< in the extension
  const char* property;  ///< of a node
  std::size_t width;
  std::vector<float> values = {};
};

/// An attribute that does not place the instances, such as "_ID".
struct OwnAttribute {
  std::string name;
  std::size_t width = 1;
  std::vector<double> values;
};

/// Instances of one node.
class InstancedNode {
 public:
  InstancedNode(const Json& attributes, GltfBuffers& buffers, const std::string& name,
                std::vector<Diagnostic>& problems)
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
    for (const auto& [key, accessor] : attributes.items())
      if (!isTransform(key)) readOwnAttribute(key, accessor, problems);
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
    for (const OwnAttribute& attribute : ownAttributes_) {
      const auto first =
          attribute.values.begin() + static_cast<std::ptrdiff_t>(instance * attribute.width);
      Json& extra = node["extras"][attribute.name];
      if (attribute.width == 1) {
        extra = *first;
      } else {
        extra = std::vector<double>(first, first + static_cast<std::ptrdiff_t>(attribute.width));
      }
    }
    return node;
  }

 private:
  bool isTransform(const std::string& key) const {
    return std::any_of(attributes_.begin(), attributes_.end(),
                       [&](const InstanceAttribute& attribute) { return key == attribute.name; });
  }

  /// Keeps it for the nodes' extras, or reports why it cannot.
  void readOwnAttribute(const std::string& key, const Json& accessor,
                        std::vector<Diagnostic>& problems) {
    OwnAttribute attribute{key, 1, {}};
    std::string fault;
    try {
      if (!accessor.is_number_unsigned()) buffers_.fail("is not an accessor");
      attribute.values = buffers_.readValues(accessor.get<std::size_t>(), attribute.width);
      buffers_.spend(*count_, kAttributeBytes + attribute.width * kNumberBytes, name_);
      if (attribute.values.size() != *count_ * attribute.width) fault = "not one per instance";
      if (!std::all_of(attribute.values.begin(), attribute.values.end(),
                       [](double value) { return std::isfinite(value); }))
        fault = "a value is not finite";
    } catch (const UnreadableGltf&) {
      throw;
    } catch (const ImportError& error) {
      fault = error.what();
    }
    if (fault.empty()) {
      ownAttributes_.push_back(std::move(attribute));
    } else {
      addDiagnostic(problems, "instance_attributes_ignored", name_ + ": " + key + ": " + fault);
    }
  }

  void setCount(std::size_t count) {
    if (count_.value_or(count) != count)
      buffers_.fail(name_ + ": the attributes of its instances differ in length");
    count_ = count;
  }

  GltfBuffers& buffers_;
  std::string name_;
  std::optional<std::size_t> count_;
  std::vector<OwnAttribute> ownAttributes_;
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
  const InstancedNode instances(*attributes, buffers, name, problems);
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
