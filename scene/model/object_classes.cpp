#include "scene/model/object_classes.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <set>
#include <string_view>

namespace enfilade::scene {
namespace {

const std::string& findClass(const Model& model, const Object& object) {
  const std::string& own = object.ifcClass.empty() ? object.className : object.ifcClass;
  if (!own.empty() || !object.partOf) return own;
  const Object& whole = model.objects[*object.partOf];
  return whole.ifcClass.empty() ? whole.className : whole.ifcClass;
}

/// Removes a number at the end of a name, with the `mark` before it.
std::optional<std::uint32_t> takeNumber(std::string_view& name, char mark) {
  const std::size_t at = name.rfind(mark);
  if (at == name.npos) return std::nullopt;
  std::uint32_t number = 0;
  const char* const end = name.data() + name.size();
  const auto [last, error] = std::from_chars(name.data() + at + 1, end, number);
  if (error != std::errc() || last != end) return std::nullopt;
  name.remove_suffix(name.size() - at);
  return number;
}

/// A node's name without what exporters append to make it unique: "bed_node_3#2" is "bed".
std::string_view trimUniqueSuffix(std::string_view name) {
  constexpr std::string_view kNode = "_node";
  takeNumber(name, '#');
  std::string_view numbered = name;
  if (takeNumber(numbered, '_') && numbered.ends_with(kNode)) name = numbered;
  if (name.ends_with(kNode)) name.remove_suffix(kNode.size());
  return name;
}

/// Primitive k of a mesh that a file splits into nodes, such as "bed/bed_0" and "bed/bed_1".
struct SplitPrimitive {
  std::string_view parent;  ///< path
  std::uint32_t number = 0;
};

std::optional<SplitPrimitive> parseSplitPrimitive(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (slash == path.npos) return std::nullopt;
  const std::string_view parent = path.substr(0, slash);
  std::string_view name = trimUniqueSuffix(path.substr(slash + 1));
  const auto number = takeNumber(name, '_');
  if (!number || name != trimUniqueSuffix(parent.substr(parent.rfind('/') + 1)))
    return std::nullopt;
  return SplitPrimitive{parent, *number};
}

/// True for objects whose thing the model says: by a list, a whole, a product or a body.
std::vector<bool> findAssignedObjects(const Model& model) {
  std::vector<bool> isAssigned;
  for (const Object& object : model.objects)
    isAssigned.push_back(object.thing || object.partOf || !object.globalId.empty());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) isAssigned[object] = true;
  return isAssigned;
}

/// Joins the primitives of each split mesh: nodes with its name and all numbers from 0. A file
/// splits by material, so things of one material, such as chairs in a row, are not joined.
void joinSplitMeshes(const Model& model, std::vector<std::uint32_t>& first) {
  const std::vector<bool> isAssigned = findAssignedObjects(model);
  std::map<std::string_view, std::map<std::uint32_t, std::uint32_t>> meshes;  // object by number
  for (std::uint32_t i = 0; i < first.size(); ++i) {
    const Object& object = model.objects[i];
    if (isAssigned[i] || object.meshes.size() != 1) continue;
    if (const auto primitive = parseSplitPrimitive(object.path))
      meshes[primitive->parent].emplace(primitive->number, i);
  }
  for (const auto& [parent, primitives] : meshes) {
    std::set<std::uint32_t> materials;
    std::uint32_t whole = primitives.begin()->second;
    for (const auto& [number, object] : primitives) {
      materials.insert(model.meshes[model.objects[object].meshes.front()].material);
      whole = std::min(whole, object);
    }
    if (materials.size() != primitives.size() || primitives.rbegin()->first + 1 != materials.size())
      continue;
    for (const auto& [number, object] : primitives) first[object] = whole;
  }
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
  joinSplitMeshes(model, first);
  for (const BodySpec& body : model.bodies)
    if (!body.objects.empty())
      for (const std::uint32_t object : body.objects) first[object] = body.objects.front();
  // A part leads to its whole, that to the first of its list, and that to the first of its body.
  for (int i = 0; i < 2; ++i)
    for (std::uint32_t& object : first) object = first[object];
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
