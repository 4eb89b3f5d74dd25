// The node tree of a glTF file together with its imported model, for readers of bodies. Private to
// the import.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/gltf/encoding/gltf_nodes.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Objects by the number of the node that owns them.
using OwnedObjects = std::map<std::size_t, std::vector<std::uint32_t>>;

/// Node tree of a glTF file.
class GltfTree {
 public:
  /// All arguments must outlive the tree.
  GltfTree(const nlohmann::json& file, const NodeTransforms& transforms, Model& model);

  const nlohmann::json& file() const { return file_; }
  Model& model() const { return model_; }
  const NodeTransforms& transforms() const { return transforms_; }
  /// Returns the node's JSON; an empty object for an unknown number.
  const nlohmann::json& node(std::size_t number) const;
  /// Returns the object of the node's meshes, if any.
  std::optional<std::uint32_t> findObject(std::size_t number) const;
  /// Transform from the node to the scene.
  Eigen::Affine3d worldFromNode(std::size_t number) const;
  /// Returns the closest of `owners` from the node upwards, itself included.
  template <class Owners>
  std::optional<std::size_t> findOwner(std::size_t number, const Owners& owners) const {
    std::optional<std::size_t> at = number;
    for (std::size_t steps = 0; at && steps <= transforms_.size(); ++steps) {
      if (owners.contains(*at)) return at;
      const auto transform = transforms_.find(*at);
      at = transform == transforms_.end() ? std::nullopt : transform->second.parentIndex;
    }
    return std::nullopt;
  }
  /// Groups the objects of all nodes by their closest owner.
  template <class Owners>
  OwnedObjects groupObjectsByOwner(const Owners& owners) const {
    OwnedObjects owned;
    for (const auto& [number, transform] : transforms_) {
      const auto object = findObject(number);
      const auto owner = object ? findOwner(number, owners) : std::nullopt;
      if (owner) owned[*owner].push_back(*object);
    }
    for (auto& [owner, objects] : owned) std::sort(objects.begin(), objects.end());
    return owned;
  }

 private:
  const nlohmann::json& file_;
  const NodeTransforms& transforms_;
  Model& model_;
  std::map<std::string, std::uint32_t> objectOfPath_;
};

}  // namespace enfilade::scene
