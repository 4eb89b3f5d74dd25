#include "scene/model/object_classes.hpp"

#include <map>

namespace enfilade::scene {
namespace {

const std::string& findClass(const Model& model, const Object& object) {
  const std::string& own = object.ifcClass.empty() ? object.className : object.ifcClass;
  if (!own.empty() || !object.partOf) return own;
  const Object& whole = model.objects[*object.partOf];
  return whole.ifcClass.empty() ? whole.className : whole.ifcClass;
}

/// The first object of each object's thing.
std::vector<std::uint32_t> groupThings(const Model& model) {
  std::vector<std::uint32_t> first(model.objects.size());
  std::map<std::string, std::uint32_t> products;  // by GlobalId
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    const Object& object = model.objects[i];
    first[i] = object.thing.value_or(object.partOf.value_or(i));
    if (!object.thing && !object.partOf && !object.globalId.empty())
      first[i] = products.try_emplace(object.globalId, i).first->second;
  }
  for (const BodySpec& body : model.bodies)
    if (!body.objects.empty())
      for (const std::uint32_t object : body.objects) first[object] = body.objects.front();
  return first;
}

/// The ids, each replaced by `getLabel(id)`. Adjacent pixels mostly show the same entity.
template <class GetLabel>
std::vector<std::uint32_t> labelPixels(const std::vector<std::uint32_t>& ids,
                                       const GetLabel& getLabel) {
  std::vector<std::uint32_t> labels;
  labels.reserve(ids.size());
  std::uint32_t id = 0, label = 0;
  for (const std::uint32_t next : ids) {
    if (next != id) id = next, label = getLabel(id);
    labels.push_back(label);
  }
  return labels;
}

}  // namespace

std::uint32_t ObjectClasses::getClass(std::uint32_t entity) const {
  if (entity == 0) return 0;
  return entity <= classIds.size() ? classIds[entity - 1]
                                   : static_cast<std::uint32_t>(names.size() - 1);
}

std::uint32_t ObjectClasses::getThing(std::uint32_t entity) const {
  return entity == 0 || entity > things.size() ? entity : things[entity - 1];
}

std::vector<std::uint32_t> ObjectClasses::getClasses(const std::vector<std::uint32_t>& ids) const {
  return labelPixels(ids, [this](std::uint32_t id) { return getClass(id); });
}

std::vector<std::uint32_t> ObjectClasses::getThings(const std::vector<std::uint32_t>& ids) const {
  return labelPixels(ids, [this](std::uint32_t id) { return getThing(id); });
}

ObjectClasses computeObjectClasses(const Model& model) {
  std::map<std::string, std::uint32_t> ids{{"", 0}};
  for (const Object& object : model.objects) ids.try_emplace(findClass(model, object), 0);
  ObjectClasses classes;
  for (auto& [name, id] : ids) {
    id = static_cast<std::uint32_t>(classes.names.size());
    classes.names.push_back(name);
  }
  classes.names.emplace_back("avatar");
  for (const Object& object : model.objects)
    classes.classIds.push_back(ids.at(findClass(model, object)));
  for (const std::uint32_t object : groupThings(model)) classes.things.push_back(object + 1);
  return classes;
}

}  // namespace enfilade::scene
