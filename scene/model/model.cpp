#include "scene/model/model.hpp"

#include <set>

namespace enfilade::scene {
namespace {

using OptionalError = std::optional<std::string>;

OptionalError validateObjects(const BodySpec& body, const Model& model,
                              std::vector<bool>& claimed) {
  if (body.objects.empty()) return "objects: at least one is required";
  for (const std::uint32_t object : body.objects) {
    if (object >= model.objects.size()) return "objects: unknown object " + std::to_string(object);
    if (claimed[object])
      return "objects: '" + model.objects[object].path + "' is in two bodies, or twice in one";
    claimed[object] = true;
  }
  return std::nullopt;
}

}  // namespace

std::optional<std::string> validateBodies(const Model& model) {
  std::vector<bool> claimed(model.objects.size());
  std::set<std::string> names;
  for (const BodySpec& body : model.bodies) {
    OptionalError error = validateObjects(body, model, claimed);
    if (!error) error = validateBody(body);
    if (!error && body.name.empty()) error = "name is empty";
    if (!error && !names.insert(body.name).second) error = "name: another body already uses it";
    if (error) return "body '" + body.name + "': " + *error;
  }
  return std::nullopt;
}

const Material& findMaterial(const Model& model, const Mesh& mesh) {
  static const Material plain;
  return mesh.material < model.materials.size() ? model.materials[mesh.material] : plain;
}

}  // namespace enfilade::scene
