// A still scene, ready to be walked in: the model, a tight box an object, and collision parts that
// are built when something first comes near. Immutable to its readers; worlds share it.
#pragma once

#include <memory>
#include <vector>

#include "scene/model/model.hpp"
#include "scene/model/shapes/collision_geometry.hpp"
#include "scene/world/data/body_shape.hpp"

namespace enfilade::scene {

class Scene {
 public:
  /// Throws std::invalid_argument, saying what is wrong with the model.
  explicit Scene(Model model);
  ~Scene();
  Scene(const Scene&) = delete;
  Scene& operator=(const Scene&) = delete;

  const Model& model() const { return model_; }
  /// Still objects with at least one triangle that has an area, and not only drawn; besides bodies,
  /// only these can be touched. Box i belongs to object solidObjects()[i].
  const std::vector<std::uint32_t>& solidObjects() const { return solidObjects_; }
  const std::vector<Box>& stillBoxes() const { return stillBoxes_; }
  const Box& bounds() const { return bounds_; }  ///< of all objects, scene frame, metres
  /// Of model().bodies[body].
  std::shared_ptr<const BodyShape> shapeOfBody(std::size_t body) const { return bodyShapes_[body]; }
  /// Of everything that decides contact: boxes, and so positions. For Welcome and recordings.
  std::uint64_t hash() const { return hash_; }

  /// What an object is made of, in its meshes' frame. Objects of the same meshes share one shape.
  /// Worked out at the first call, from any thread.
  const Shape& shape(std::uint32_t object) const;
  /// The collision parts of an object in the scene's frame. Built at the first call, from any
  /// thread; everyone gets the same.
  const ObjectParts& parts(std::uint32_t object) const;

  std::size_t shapeCount() const { return meshesOfShape_.size(); }
  /// Which shape the object has, < shapeCount().
  std::uint32_t shapeNumber(std::uint32_t object) const { return shapeOfObject_[object]; }

  /// Bytes held for collision, beside the model.
  struct Memory {
    std::size_t geometry = 0;   ///< positions and triangles that were copied from the model
    std::size_t perObject = 0;  ///< boxes, numbers and places for parts
    std::size_t parts = 0;      ///< built so far
  };
  Memory memory() const;

 private:
  template <class T>
  struct Lazy;
  void numberShapes();
  void boxObjects(const std::vector<bool>& moves);

  Model model_;
  std::vector<std::uint32_t> solidObjects_;
  std::vector<Box> stillBoxes_;
  std::vector<std::shared_ptr<const BodyShape>> bodyShapes_;
  Box bounds_;
  std::uint64_t hash_ = 0;
  std::vector<std::uint32_t> shapeOfObject_;
  std::vector<std::vector<std::uint32_t>> meshesOfShape_;
  std::unique_ptr<Lazy<Shape>> shapes_;
  std::unique_ptr<Lazy<ObjectParts>> parts_;
};

/// The triangles of an object that have an area, scene frame, in the order of the model.
std::vector<collision::Triangle> solidTriangles(const Model& model, std::uint32_t object);

}  // namespace enfilade::scene
