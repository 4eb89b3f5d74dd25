// Figure: the mesh of a standing or crouching person that is drawn for an avatar.
#pragma once

#include "scene/model/model.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::render {

/// Whether the avatar can be drawn as a person: a mere prism. An avatar of parts, or with links,
/// has a shape of its own.
bool isPerson(const scene::AvatarSnapshot& avatar);

/// A placed mesh. The mesh faces +X. Its feet are at the origin, its height is 1, and its greatest
/// distance from the vertical axis is at most 1. It has normals. Equal poses share a mesh, which
/// lives as long as the program.
struct Figure {
  const scene::Mesh* mesh = nullptr;
  Eigen::Affine3d worldFromMesh;
};

/// The figure of a person: as high as the avatar, facing along its view, within its collision
/// shape. isPerson() must hold.
Figure placeFigure(const scene::AvatarSnapshot& avatar);

}  // namespace enfilade::render
