// Writes a scene as binary glTF 2.0 for viewers: the page at "/", Blender, three.js.
//
// This room is part of the server, not of the scene: it needs the encoders of render/image, and the
// scene's rooms write no files.
//
// Contents. All coordinates are in the scene's frame: metres, Y up, offset removed.
//   - scenes[0].extras: `sceneHash` (16 hexadecimal digits), `offset` (file = scene + offset) and
//     `entities`, one entry per object of the model. An entry has `id` and `path`; if known
//     `globalId`, `class`, `operation`, `storey` (a name), `partOf` (an id) and `body` (a name).
//     `only` is "drawn" or "solid" for objects that do not collide or are not drawn. Solid ones and
//     trigger volumes have no geometry here. `storeys` have `name`, `elevation` and `globalId`,
//     `spaces` also `longName` and a box (`min`, `max`).
//   - A merged node has one primitive with the attribute _ENTITY_ID, an id per vertex. Its extras:
//     `entities`, the ids in the order of the indices, and `triangles`, their numbers of triangles.
//   - An instanced node (EXT_mesh_gpu_instancing) has TRANSLATION, ROTATION, SCALE and _ENTITY_ID
//     per instance. Its extras: `entities`, the ids in the order of the instances.
//   - A body, kinematic or dynamic, is a node at its initial pose, to be moved by viewers. Its
//     extras: `body` (name), `entity` (id) and `kind`. Its children are the body's objects, with
//     `entity`.
// draw_groups.hpp decides between merging and instancing. Ids are floats, because glTF allows
// 32-bit integers only as indices.
//
// The bytes depend on the scene alone.
#pragma once

#include <cstdint>
#include <vector>

#include "scene/world/data/scene.hpp"

namespace enfilade::server {

struct SceneGlb {
  std::vector<std::uint8_t> bytes;
  std::size_t entities = 0;
  std::size_t triangles = 0;   ///< drawn, counting every instance
  std::size_t drawGroups = 0;  ///< draw calls of a viewer that draws every primitive once
};

struct GlbContent {
  bool bodies = true;    ///< false: the viewer receives the bodies in another way
  bool textures = true;  ///< false: a smaller file, with the materials' colours
};

/// Throws std::runtime_error if the scene exceeds the format: 4 GiB or 2^24 objects.
SceneGlb writeSceneGlb(const scene::Scene& scene, const GlbContent& content = {});

}  // namespace enfilade::server
