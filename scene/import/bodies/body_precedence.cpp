#include "scene/import/bodies/body_precedence.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

/// Of each object, the body that it is in, or null.
std::vector<const BodySpec*> bodiesOfObjects(const Model& model) {
  std::vector<const BodySpec*> bodies(model.objects.size());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) bodies[object] = &body;
  return bodies;
}

std::string unusedName(const std::string& wanted, std::set<std::string>& taken) {
  std::string name = wanted;
  for (std::size_t number = 2; !taken.insert(name).second; ++number)
    name = wanted + "#" + std::to_string(number);
  return name;
}

}  // namespace

void addProblem(Model& model, const char* kind, const std::string& example, std::size_t count) {
  if (count == 0) return;
  const auto known = std::find_if(model.problems.begin(), model.problems.end(),
                                  [&](const Problem& problem) { return problem.kind == kind; });
  if (known == model.problems.end()) {
    model.problems.push_back({kind, count, example});
  } else {
    known->count += count;
  }
}

void addLowerBodies(Model& model, std::vector<BodySpec> bodies,
                    const std::set<std::uint32_t>& still) {
  const std::vector<const BodySpec*> higher = bodiesOfObjects(model);
  std::set<std::string> names;
  for (const BodySpec& body : model.bodies) names.insert(body.name);
  std::vector<BodySpec> added;
  for (BodySpec& body : bodies) {
    const auto rival = std::find_if(body.objects.begin(), body.objects.end(),
                                    [&](std::uint32_t object) { return higher[object]; });
    if (rival != body.objects.end()) {
      addProblem(model, "replaced_bodies",
                 body.name + " of " + wordOf(body.source) + ": '" + higher[*rival]->name + "' of " +
                     wordOf(higher[*rival]->source) + " has '" + model.objects[*rival].path + "'");
      continue;
    }
    std::erase_if(body.objects, [&](std::uint32_t object) { return still.contains(object); });
    if (body.objects.empty()) continue;
    body.name = unusedName(body.name, names);
    added.push_back(std::move(body));
  }
  for (BodySpec& body : added) model.bodies.push_back(std::move(body));
}

void takeCollisionShapesAlong(Model& model) {
  constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::vector<std::size_t> bodyOf(model.objects.size(), kNone);
  for (std::size_t b = 0; b < model.bodies.size(); ++b)
    for (const std::uint32_t object : model.bodies[b].objects) bodyOf[object] = b;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    if (object.use != Object::Use::solid || !object.pieceOf || bodyOf[i] != kNone) continue;
    const std::size_t body = bodyOf[*object.pieceOf];
    if (body != kNone) model.bodies[body].objects.push_back(i);
  }
}

}  // namespace enfilade::scene
