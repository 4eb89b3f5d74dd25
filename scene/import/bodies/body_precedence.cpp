#include "scene/import/bodies/body_precedence.hpp"

#include <algorithm>
#include <cmath>

#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

/// A file may describe a body twice in the same way.
bool isSameBody(const BodySpec& a, const BodySpec& b) {
  const bool sameAnchor = a.kind != BodyKind::hinged || a.anchor.isApprox(b.anchor, 1e-6);
  return a.kind == b.kind && a.objects == b.objects && sameAnchor &&
         a.axis.isApprox(b.axis, 1e-6) && std::abs(a.low - b.low) < 1e-6 &&
         std::abs(a.high - b.high) < 1e-6 && a.mass == b.mass && a.density == b.density &&
         a.speed == b.speed && a.keys.size() == b.keys.size();
}

std::string makeUniqueName(const std::string& wanted, std::set<std::string>& taken) {
  std::string name = wanted;
  for (std::size_t number = 2; !taken.insert(name).second; ++number)
    name = wanted + "#" + std::to_string(number);
  return name;
}

}  // namespace

void mergeLowerPriorityBodies(Model& model, std::vector<BodySpec> bodies,
                              const std::set<std::uint32_t>& staticObjects) {
  const std::vector<const BodySpec*> bodyOfObject = mapObjectsToBodies(model);
  std::set<std::string> names;
  for (const BodySpec& body : model.bodies) names.insert(body.name);
  std::vector<BodySpec> added;
  for (BodySpec& body : bodies) {
    const auto conflict = std::find_if(body.objects.begin(), body.objects.end(),
                                       [&](std::uint32_t object) { return bodyOfObject[object]; });
    if (conflict != body.objects.end()) {
      if (isSameBody(body, *bodyOfObject[*conflict])) continue;
      addDiagnostic(model.diagnostics, "replaced_bodies",
                    "'" + body.name + "' of the " + toString(body.source) + " by '" +
                        bodyOfObject[*conflict]->name + "' of the " +
                        toString(bodyOfObject[*conflict]->source) + ", object " +
                        model.objects[*conflict].path);
      continue;
    }
    std::erase_if(body.objects,
                  [&](std::uint32_t object) { return staticObjects.contains(object); });
    if (body.objects.empty()) continue;
    body.name = makeUniqueName(body.name, names);
    added.push_back(std::move(body));
  }
  for (BodySpec& body : added) model.bodies.push_back(std::move(body));
}

void attachCollisionShapes(Model& model) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> bodyByObject(model.objects.size(), kNone);
  for (std::size_t b = 0; b < model.bodies.size(); ++b)
    for (const std::uint32_t object : model.bodies[b].objects) bodyByObject[object] = b;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    if (object.usage != Object::Usage::collisionOnly || !object.partOf || bodyByObject[i] != kNone)
      continue;
    const std::size_t body = bodyByObject[*object.partOf];
    if (body != kNone) model.bodies[body].objects.push_back(i);
  }
}

}  // namespace enfilade::scene
