// Conversion of Enfilade's plain data to Foxglove messages.
#pragma once

#include <cstdint>
#include <span>

#include "protocol/foxglove.pb.h"
#include "scene/world/world.hpp"

namespace enfilade::server {

/// `seconds`: simulated time, >= 0.
google::protobuf::Timestamp toTimestamp(double seconds);

foxglove::Vector3 toVector(const scene::Vec3& v);
foxglove::Quaternion toQuaternion(const Eigen::Quaterniond& q);
foxglove::Color makeColour(const Eigen::Vector3f& rgb, double alpha = 1);

/// Rotation from a Y-up frame to its Z-up parent: 90 degrees about X.
Eigen::Quaterniond convertYUpToZUp();

/// An AABB as a cube.
foxglove::CubePrimitive makeCube(const scene::Aabb& box, const foxglove::Color& colour);

/// The static objects: all triangles if there are at most `maxTriangles`. Otherwise one AABB per
/// object if there are at most `maxBoxes`, or else the AABB of the scene.
foxglove::SceneEntity makeStaticEntity(const scene::Scene& scene, std::size_t maxTriangles,
                                       std::size_t maxBoxes);
/// A glTF file as the static objects.
foxglove::SceneEntity makeModelEntity(std::span<const std::uint8_t> glb);
/// The objects of body `body`, in the body's frame.
foxglove::SceneEntity makeBodyEntity(const scene::Scene& scene, std::size_t body);
/// The avatar's parts and name, in the avatar's frame.
foxglove::SceneEntity makeAvatarEntity(const scene::AvatarSnapshot& avatar);

}  // namespace enfilade::server
