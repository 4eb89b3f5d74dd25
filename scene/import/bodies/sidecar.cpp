#include "scene/import/bodies/sidecar.hpp"

#include <algorithm>

#include "scene/import/bodies/body_fields.hpp"
#include "scene/world/data/scene.hpp"

namespace enfilade::scene {
namespace {

using nlohmann::json;

constexpr std::size_t kMostBodies = 100000;

// ---- objects -----------------------------------------------------------------------------------

/// Objects of that path or GlobalId; a path that ends in * stands for all that begin so, pieces of
/// others left out: collision shapes follow what they belong to, and doors' frames stay.
std::vector<std::uint32_t> objectsOf(const JsonPlace& place, const Model& model) {
  const std::string wanted = textOf(place);
  const bool open = wanted.back() == '*';
  const std::string_view stem(wanted.data(), wanted.size() - (open ? 1 : 0));
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    const bool same = open ? object.path.starts_with(stem) && !object.pieceOf
                           : object.path == wanted || object.globalId == wanted;
    if (same) found.push_back(i);
  }
  if (found.empty())
    place.fail("there is no object " + excerpt(place.value) +
               (model.objects.empty() ? "" : "; the first one is '" + model.objects[0].path + "'"));
  return found;
}

std::vector<std::uint32_t> listOfObjects(const JsonPlace& place, const Model& model) {
  if (!place.value.is_array() || place.value.empty())
    place.fail("must be a list of objects' paths or GlobalIds, not " + excerpt(place.value));
  std::vector<std::uint32_t> all;
  for (std::size_t i = 0; i < place.value.size(); ++i)
    for (const std::uint32_t object : objectsOf(place.at(i), model)) all.push_back(object);
  return all;
}

Box boxOf(const Model& model, const std::vector<std::uint32_t>& objects) {
  Box box;
  for (const std::uint32_t object : objects)
    for (const collision::Triangle& t : solidTriangles(model, object))
      box.include(collision::boxOf(t));
  return box;
}

/// An object of its own for a trigger that is no object of the file.
std::uint32_t addBox(Model& model, const std::string& name, const Box& box) {
  Mesh mesh;
  mesh.name = name;
  const Vec3 centre = box.centre();
  for (unsigned i = 0; i < 8; ++i) {
    const Vec3 corner((i & 1u) != 0 ? box.max.x() : box.min.x(),
                      (i & 2u) != 0 ? box.max.y() : box.min.y(),
                      (i & 4u) != 0 ? box.max.z() : box.min.z());
    mesh.positions.push_back((corner - centre).cast<float>());
  }
  mesh.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  if (model.materials.empty()) model.materials.emplace_back();
  model.meshes.push_back(std::move(mesh));
  Object object;
  object.path = "walk.json/" + name;
  object.meshes = {static_cast<std::uint32_t>(model.meshes.size() - 1)};
  object.worldFromMesh.translation() = centre;
  model.objects.push_back(std::move(object));
  return static_cast<std::uint32_t>(model.objects.size() - 1);
}

// ---- bodies ------------------------------------------------------------------------------------

/// Where the axis goes that no anchor places.
void placeAnchor(const JsonPlace& place, const BodyFields& fields, const Model& model,
                 BodySpec& body) {
  if (fields.anchor || !isKinematic(body.kind)) return;
  if (body.kind == BodyKind::hinged) place.fail("anchor is missing: a point of the axis, [x,y,z]");
  if (const Box box = boxOf(model, body.objects); !box.empty()) body.anchor = box.centre();
}

void readBox(const JsonPlace& box, BodySpec& body, Model& model) {
  if (!box.value.is_array() || box.value.size() != 2)
    box.fail("must be two corners, [[x,y,z],[x,y,z]]");
  const Vec3 a = vectorOf(box.at(std::size_t{0})), b = vectorOf(box.at(std::size_t{1}));
  if (!((a - b).cwiseAbs().minCoeff() > 0)) box.fail("has no volume");
  body.objects.push_back(addBox(model, body.name, {a.cwiseMin(b), a.cwiseMax(b)}));
}

/// A body for each object, named after it.
void addEach(Model& model, const BodySpec& body) {
  for (std::size_t i = 0; i < body.objects.size(); ++i) {
    BodySpec one = body;
    one.objects = {body.objects[i]};
    one.name = body.objects.size() == 1 ? body.name : body.name + "#" + std::to_string(i + 1);
    model.bodies.push_back(std::move(one));
  }
}

std::vector<const char*> ownKeys(BodyKind kind) {
  if (kind == BodyKind::rigid) return {"objects", "each"};
  if (kind == BodyKind::trigger) return {"objects", "box"};
  return {"objects"};
}

void readBody(const JsonPlace& place, Model& model) {
  if (!place.value.is_object()) place.fail("must be an object, not " + excerpt(place.value));
  for (const char* key : {"name", "kind"})
    if (!place.has(key)) place.fail(std::string(key) + " is missing");
  BodySpec body;
  body.source = BodySource::sidecar;
  body.name = textOf(place.at("name"));
  body.kind = kindOf(place);
  if (place.has("objects")) body.objects = listOfObjects(place.at("objects"), model);
  if (!place.has("objects") && !place.has("box"))
    place.fail("objects is missing: a list of paths or GlobalIds");
  const BodyFields fields = readBodyFields(place, ownKeys(body.kind), body);
  if (place.has("objects") && place.has("box"))
    place.fail("has objects and a box: a trigger is either");
  placeAnchor(place, fields, model, body);
  if (place.has("box")) readBox(place.at("box"), body, model);
  if (place.has("each") && truthOf(place.at("each"))) return addEach(model, body);
  model.bodies.push_back(std::move(body));
}

void readBodies(const JsonPlace& bodies, Model& model) {
  if (!bodies.value.is_array()) bodies.fail("must be a list, not " + excerpt(bodies.value));
  if (bodies.value.size() > kMostBodies) bodies.fail("has too many entries");
  for (std::size_t i = 0; i < bodies.value.size(); ++i) {
    const std::size_t before = model.bodies.size();
    readBody(bodies.at(i), model);
    for (std::size_t k = before; k < model.bodies.size(); ++k)
      if (const auto why = refusalOfBody(model.bodies[k]))
        bodies.at(i).fail("body '" + model.bodies[k].name + "': " + *why);
  }
}

/// The objects of `still`, none of which may be in a body of the same sidecar.
std::set<std::uint32_t> stillObjects(const JsonPlace& place, const Model& model) {
  const std::vector<std::uint32_t> objects = listOfObjects(place, model);
  const std::set<std::uint32_t> still(objects.begin(), objects.end());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects)
      if (still.contains(object))
        place.fail("'" + model.objects[object].path + "' is in the body '" + body.name +
                   "': it is either");
  return still;
}

/// What a sidecar may add to.
struct Extent {
  std::size_t materials, meshes, objects, bodies;
};

Extent extentOf(const Model& model) {
  return {model.materials.size(), model.meshes.size(), model.objects.size(), model.bodies.size()};
}

void cutBack(Model& model, const Extent& extent) {
  model.materials.resize(extent.materials);
  model.meshes.resize(extent.meshes);
  model.objects.resize(extent.objects);
  model.bodies.resize(extent.bodies);
}

}  // namespace

std::filesystem::path sidecarOf(const std::filesystem::path& model) {
  std::filesystem::path sidecar = model;
  return sidecar.replace_extension(".walk.json");
}

Sidecar applySidecar(Model& model, std::string_view text, const std::string& source) {
  const json whole = parsed(text, source);
  const JsonPlace place{whole, source};
  allowOnly(place, {"walk", "bodies", "still"});
  if (!place.has("walk") || whole["walk"] != 1)
    place.fail("must say \"walk\":1, the format's version");
  Sidecar sidecar;
  const Extent before = extentOf(model);
  try {
    if (place.has("bodies")) readBodies(place.at("bodies"), model);
    if (place.has("still")) sidecar.still = stillObjects(place.at("still"), model);
    if (const auto why = refusalOfBodies(model)) throw SidecarError(source + ": " + *why);
  } catch (...) {
    cutBack(model, before);
    throw;
  }
  return sidecar;
}

}  // namespace enfilade::scene
