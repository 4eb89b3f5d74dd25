#include "scene/import/bodies/gltf_tree.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

const Json kEmptyObject = Json::object();

}  // namespace

GltfTree::GltfTree(const Json& file, const NodeTransforms& transforms, Model& model)
    : file_(file), transforms_(transforms), model_(model) {
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    objectOfPath_.emplace(model.objects[i].path, i);
}

const Json& GltfTree::node(std::size_t number) const {
  const auto nodes = file_.find("nodes");
  const bool there = nodes != file_.end() && nodes->is_array() && number < nodes->size() &&
                     (*nodes)[number].is_object();
  return there ? (*nodes)[number] : kEmptyObject;
}

std::optional<std::uint32_t> GltfTree::findObject(std::size_t number) const {
  const auto transform = transforms_.find(number);
  if (transform == transforms_.end()) return std::nullopt;
  const auto object = objectOfPath_.find(transform->second.path);
  return object == objectOfPath_.end() ? std::nullopt : std::optional(object->second);
}

Eigen::Affine3d GltfTree::worldFromNode(std::size_t number) const {
  return Eigen::Translation3d(-model_.offset) * transforms_.at(number).worldFromNode;
}

}  // namespace enfilade::scene
