#include "scene/world/bodies/body.hpp"

#include <cmath>

#include "scene/model/rotation.hpp"

namespace enfilade::scene {
namespace {

/// Of what a turned and moved vertex is made of: more than its four roundings.
constexpr double kRounding = 0x1p-49;

Box placedBox(const collision::Hull& hull, const Body& body) {
  Box box;
  for (const Vec3& vertex : hull.vertices)
    box.include(body.turned ? Vec3(body.rotation * vertex + body.position)
                            : Vec3(vertex + body.position));
  const double reach = 2 * hull.radius + body.position.cwiseAbs().maxCoeff();
  return grown(box, kRounding * reach);
}

}  // namespace

void placeBody(Body& body, const Vec3& position, const collision::Quat& orientation) {
  body.position = position;
  body.orientation = orientation;
  body.rotation = orientation.toRotationMatrix();
  body.turned = body.rotation != collision::Mat3::Identity();
  const auto& parts = body.shape->parts;
  body.partBoxes.resize(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) body.partBoxes[i] = placedBox(parts[i], body);
}

collision::ConvexBody partOf(const Body& body, std::uint32_t part) {
  const collision::Hull& hull = body.shape->parts[part];
  return {hull.vertices, body.position, body.turned ? &body.rotation : nullptr, &hull};
}

Box boxOf(const Body& body) {
  Box box;
  for (const Box& part : body.partBoxes) box.include(part);
  return box;
}

collision::Pose poseAt(const BodySpec& spec, const BodyPlace& place) {
  return {rotationAbout(spec.axis, place.turn).normalized(), spec.anchor + place.offset};
}

BodyPlace placeBetween(const BodyPlace& from, const BodyPlace& to, double s) {
  return {from.offset + s * (to.offset - from.offset), from.turn + s * (to.turn - from.turn)};
}

double farthestWay(const BodyShape& shape, const BodyPlace& from, const BodyPlace& to) {
  return (to.offset - from.offset).norm() + std::abs(to.turn - from.turn) * shape.radius;
}

}  // namespace enfilade::scene
