// A glTF file's tree of nodes beside the model that it became, for those who read bodies from it.
// Private to the import.
#pragma once

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/assimp/convert_scene.hpp"

namespace enfilade::scene {

/// Objects of one owner.
using OwnedObjects = std::map<std::size_t, std::vector<std::uint32_t>>;  ///< by the owner's number

class GltfTree {
 public:
  /// All must live longer.
  GltfTree(const nlohmann::json& file, const NodePlaces& places, Model& model);

  const nlohmann::json& file() const { return file_; }
  Model& model() const { return model_; }
  const NodePlaces& places() const { return places_; }
  /// The node's JSON; an empty object for a number that there is not.
  const nlohmann::json& node(std::size_t number) const;
  /// The object that the node's meshes became, if they did.
  std::optional<std::uint32_t> objectOf(std::size_t number) const;
  /// In the scene's frame.
  Eigen::Affine3d worldFromNode(std::size_t number) const;
  /// The nearest of `owners` from the node upwards, itself among them.
  template <class Owners>
  std::optional<std::size_t> ownerOf(std::size_t number, const Owners& owners) const {
    std::optional<std::size_t> at = number;
    for (std::size_t steps = 0; at && steps <= places_.size(); ++steps) {
      if (owners.contains(*at)) return at;
      const auto place = places_.find(*at);
      at = place == places_.end() ? std::nullopt : place->second.above;
    }
    return std::nullopt;
  }
  /// The objects of all nodes, by the nearest owner.
  template <class Owners>
  OwnedObjects objectsByOwner(const Owners& owners) const {
    OwnedObjects owned;
    for (const auto& [number, place] : places_) {
      const auto object = objectOf(number);
      const auto owner = object ? ownerOf(number, owners) : std::nullopt;
      if (owner) owned[*owner].push_back(*object);
    }
    for (auto& [owner, objects] : owned) std::sort(objects.begin(), objects.end());
    return owned;
  }

 private:
  const nlohmann::json& file_;
  const NodePlaces& places_;
  Model& model_;
  std::map<std::string, std::uint32_t> objectOfPath_;
};

/// Bodies of KHR_physics_rigid_bodies, which join no model yet; their collision shapes do. What
/// cannot be had is counted as the problem `unsupported_physics`.
std::vector<BodySpec> physicsBodies(GltfTree& tree);

/// A mesh in the shape's own frame, of an entry of KHR_implicit_shapes; nullopt when it makes no
/// sense. Round ones are polytopes with their corners on the surface.
std::optional<Mesh> implicitShape(const nlohmann::json& shape);

}  // namespace enfilade::scene
