// ObjectClasses: semantic classes and instances (things) of objects, for labelled images and lists
// of objects.
#pragma once

#include <string>
#include <vector>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Class and thing of each entity of a model.
struct ObjectClasses {
  std::vector<std::string> names;  ///< by class id; 0: "", no class; then sorted; last "avatar"
  std::vector<std::uint32_t> classIds;  ///< by object
  std::vector<std::uint32_t> things;  ///< by object: the entity id of the first object of its thing

  /// Of an entity id; avatars, which follow the objects, have the last class. 0 for id 0.
  std::uint32_t getClass(std::uint32_t entity) const;
  /// Of an entity id; an avatar is a thing of its own. 0 for id 0.
  std::uint32_t getThing(std::uint32_t entity) const;
  // Of the entity ids of an image.
  std::vector<std::uint32_t> getClasses(const std::vector<std::uint32_t>& ids) const;
  std::vector<std::uint32_t> getThings(const std::vector<std::uint32_t>& ids) const;
};

/// The class is the IFC class, else Object::className; a part without one has that of its whole. A
/// thing is a body, an IFC product, an object with its parts, or the objects of Object::thing. The
/// primitives of a mesh that a file splits by material into nodes, such as "bed/bed_0" and
/// "bed/bed_1", are one thing, too. They have all numbers from 0, each has another material, and no
/// list or body names them.
ObjectClasses computeObjectClasses(const Model& model);

}  // namespace enfilade::scene
