// Enfilade's plain data as the messages that viewers know.
#pragma once

#include <string>

#include "protocol/foxglove.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// `seconds` of simulated time, >= 0.
google::protobuf::Timestamp timestampOf(double seconds);

foxglove::Vector3 vectorOf(const scene::Vec3& v);
foxglove::Quaternion quaternionOf(const Eigen::Quaterniond& q);
foxglove::Color colourOf(const Eigen::Vector3f& rgb, double alpha = 1);

/// The turn between Y up and Z up: a frame turned so has its Y where its parent has its Z.
Eigen::Quaterniond upright();

/// A box along its frame's axes.
foxglove::CubePrimitive cubeOf(const scene::Box& box, const foxglove::Color& colour);

/// What stands still: all of its triangles if they are at most `mostTriangles`, else a box for each
/// object if those are at most `mostBoxes`, else the one box around everything.
foxglove::SceneEntity stillEntity(const scene::Scene& scene, std::size_t mostTriangles,
                                  std::size_t mostBoxes);
/// An object that is part of a body, in the body's frame.
foxglove::SceneEntity bodyEntity(const scene::Scene& scene, std::size_t body);
/// Its parts and its name, in the avatar's frame.
foxglove::SceneEntity avatarEntity(const scene::AvatarView& avatar);

}  // namespace enfilade::server
