// A still scene, ready to be walked in: the model, a tight box an object, and collision parts that
// are built when something first comes near. Immutable to its readers; worlds share it.
#pragma once

#include <memory>
#include <vector>

#include "collision/triangle_tree.hpp"
#include "scene/body_shape.hpp"
#include "scene/model.hpp"

namespace enfilade::scene {

class Scene {
 public:
  /// Throws std::invalid_argument, saying what is wrong with the model.
  explicit Scene(Model model);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const Model& model() const { return model_; }
  /// Still objects with at least one triangle that has an area; besides bodies, only these can be
  /// touched. Box i belongs to object solidObjects()[i].
  const std::vector<std::uint32_t>& solidObjects() const { return solidObjects_; }
  const std::vector<Box>& stillBoxes() const { return stillBoxes_; }
  const Box& bounds() const { return bounds_; }  ///< of all objects, scene frame, metres
  /// Of model().bodies[body].
  std::shared_ptr<const BodyShape> shapeOfBody(std::size_t body) const { return shapes_[body]; }
  /// Of everything that decides contact: boxes, and so positions. For Welcome and recordings.
  std::uint64_t hash() const { return hash_; }

  /// The triangles of an object in the scene's frame, in a tree of boxes. Built at the first call,
  /// from any thread.
  const collision::TriangleTree& triangles(std::uint32_t object) const;

 private:
  struct Lazy;
  Model model_;
  std::vector<std::uint32_t> solidObjects_;
  std::vector<Box> stillBoxes_;
  std::vector<std::shared_ptr<const BodyShape>> shapes_;
  Box bounds_;
  std::uint64_t hash_ = 0;
  std::unique_ptr<Lazy[]> lazy_;
};

/// The triangles of an object that have an area, scene frame, in the order of the model.
std::vector<collision::Triangle> solidTriangles(const Model& model, std::uint32_t object);

}  // namespace enfilade::scene
