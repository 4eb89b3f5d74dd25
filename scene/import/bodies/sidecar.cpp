#include "scene/import/bodies/sidecar.hpp"

#include <algorithm>
#include <map>

#include "scene/import/bodies/body_fields.hpp"
#include "scene/model/box_mesh.hpp"
#include "scene/model/shapes/collision_geometry.hpp"

namespace enfilade::scene {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxBodies = 100000;

// ---- objects -----------------------------------------------------------------------------------

/// Finds objects by path or GlobalId. A path that ends in * matches all paths with that prefix,
/// except parts of other objects: collision shapes follow their owner, and door frames stay.
std::vector<std::uint32_t> findObjects(const JsonCursor& cursor, const Model& model) {
  const std::string wanted = readText(cursor);
  const bool open = wanted.back() == '*';
  const std::string_view stem(wanted.data(), wanted.size() - (open ? 1 : 0));
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    const bool same = open ? object.path.starts_with(stem) && !object.partOf
                           : object.path == wanted || object.globalId == wanted;
    if (same) found.push_back(i);
  }
  if (found.empty())
    cursor.fail(
        "unknown object " + formatExcerpt(cursor.value) +
        (model.objects.empty() ? "" : "; the first one is '" + model.objects[0].path + "'"));
  return found;
}

std::vector<std::uint32_t> readObjectList(const JsonCursor& cursor, const Model& model) {
  if (!cursor.value.is_array() || cursor.value.empty())
    cursor.fail("must be a list of objects' paths or GlobalIds, not " +
                formatExcerpt(cursor.value));
  std::vector<std::uint32_t> all;
  for (std::size_t i = 0; i < cursor.value.size(); ++i)
    for (const std::uint32_t object : findObjects(cursor.at(i), model)) all.push_back(object);
  return all;
}

Aabb computeAabb(const Model& model, const std::vector<std::uint32_t>& objects) {
  Aabb box;
  for (const std::uint32_t object : objects)
    for (const collision::Triangle& t : collectSolidTriangles(model, object))
      box.include(collision::computeAabb(t));
  return box;
}

/// Adds an object for a trigger that is not an object of the file.
std::uint32_t addBoxObject(Model& model, const std::string& name, const Aabb& box) {
  const Vec3 centre = box.centre();
  Mesh mesh = makeBoxMesh({box.min - centre, box.max - centre});
  mesh.name = name;
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

/// Places an axis without an anchor.
void placeAnchor(const JsonCursor& cursor, const ExplicitBodyFields& fields, const Model& model,
                 BodySpec& body) {
  if (fields.anchor || !isKinematic(body.kind)) return;
  if (getTraits(body.kind).rotates) cursor.fail("anchor is missing: a point of the axis, [x,y,z]");
  if (const Aabb box = computeAabb(model, body.objects); !box.empty()) body.anchor = box.centre();
}

void readBox(const JsonCursor& box, BodySpec& body, Model& model) {
  if (!box.value.is_array() || box.value.size() != 2)
    box.fail("must be two corners, [[x,y,z],[x,y,z]]");
  const Vec3 a = readVector(box.at(std::size_t{0})), b = readVector(box.at(std::size_t{1}));
  if (!((a - b).cwiseAbs().minCoeff() > 0)) box.fail("has no volume");
  body.objects.push_back(addBoxObject(model, body.name, {a.cwiseMin(b), a.cwiseMax(b)}));
}

/// Adds one body per object, named after it.
void addEach(Model& model, const BodySpec& body) {
  for (std::size_t i = 0; i < body.objects.size(); ++i) {
    BodySpec one = body;
    one.objects = {body.objects[i]};
    one.name = body.objects.size() == 1 ? body.name : body.name + "#" + std::to_string(i + 1);
    model.bodies.push_back(std::move(one));
  }
}

std::vector<const char*> listAdditionalKeys(BodyKind kind) {
  if (isDynamic(kind)) return {"objects", "each"};
  if (isTrigger(kind)) return {"objects", "box"};
  return {"objects"};
}

void readBody(const JsonCursor& cursor, Model& model) {
  if (!cursor.value.is_object())
    cursor.fail("must be an object, not " + formatExcerpt(cursor.value));
  for (const char* key : {"name", "kind"})
    if (!cursor.has(key)) cursor.fail(std::string(key) + " is missing");
  BodySpec body;
  body.source = BodySource::sidecar;
  body.name = readText(cursor.at("name"));
  body.kind = readBodyKind(cursor);
  if (cursor.has("objects")) body.objects = readObjectList(cursor.at("objects"), model);
  if (!cursor.has("objects") && !cursor.has("box"))
    cursor.fail("objects is missing: a list of paths or GlobalIds");
  const ExplicitBodyFields fields = readBodyFields(cursor, listAdditionalKeys(body.kind), body);
  if (cursor.has("objects") && cursor.has("box"))
    cursor.fail("has objects and a box: a trigger is either");
  placeAnchor(cursor, fields, model, body);
  if (cursor.has("box")) readBox(cursor.at("box"), body, model);
  if (cursor.has("each") && readBool(cursor.at("each"))) return addEach(model, body);
  model.bodies.push_back(std::move(body));
}

void readBodies(const JsonCursor& bodies, Model& model) {
  if (!bodies.value.is_array()) bodies.fail("must be a list, not " + formatExcerpt(bodies.value));
  if (bodies.value.size() > kMaxBodies) bodies.fail("has too many entries");
  for (std::size_t i = 0; i < bodies.value.size(); ++i) {
    const std::size_t before = model.bodies.size();
    readBody(bodies.at(i), model);
    for (std::size_t k = before; k < model.bodies.size(); ++k)
      if (const auto reason = validateBody(model.bodies[k]))
        bodies.at(i).fail("body '" + model.bodies[k].name + "': " + *reason);
  }
}

/// Reads `still`. None of its objects may be in a body of the same sidecar.
std::set<std::uint32_t> readStaticObjects(const JsonCursor& cursor, const Model& model) {
  const std::vector<std::uint32_t> objects = readObjectList(cursor, model);
  const std::set<std::uint32_t> staticObjects(objects.begin(), objects.end());
  for (const BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects)
      if (staticObjects.contains(object))
        cursor.fail("'" + model.objects[object].path + "' is in the body '" + body.name +
                    "': it is either");
  return staticObjects;
}

/// Reads `classes`: lists of objects by class name.
void readClasses(const JsonCursor& cursor, Model& model) {
  if (!cursor.value.is_object())
    cursor.fail("must be an object of lists, as {\"chair\": [\"Cafe/Chair*\"]}, not " +
                formatExcerpt(cursor.value));
  std::map<std::string, std::vector<std::uint32_t>> objects;
  for (const auto& [name, list] : cursor.value.items()) {
    if (name.empty()) cursor.fail("has a class without a name");
    objects[name] = readObjectList({list, cursor.name + "." + name}, model);
  }
  for (const auto& [name, members] : objects)
    for (const std::uint32_t object : members) model.objects[object].className = name;
}

/// Reads `things`: each entry lists the objects of one thing.
void readThings(const JsonCursor& cursor, Model& model) {
  if (!cursor.value.is_array())
    cursor.fail("must be a list of lists of objects, not " + formatExcerpt(cursor.value));
  std::vector<std::vector<std::uint32_t>> things;
  for (std::size_t i = 0; i < cursor.value.size(); ++i)
    things.push_back(readObjectList(cursor.at(i), model));
  for (const auto& members : things)
    for (const std::uint32_t object : members)
      model.objects[object].thing = *std::ranges::min_element(members);
}

/// Sizes of the lists that a sidecar may extend.
struct ModelSizes {
  std::size_t materials, meshes, objects, bodies;
};

ModelSizes measureModel(const Model& model) {
  return {model.materials.size(), model.meshes.size(), model.objects.size(), model.bodies.size()};
}

void truncateModel(Model& model, const ModelSizes& sizes) {
  model.materials.resize(sizes.materials);
  model.meshes.resize(sizes.meshes);
  model.objects.resize(sizes.objects);
  model.bodies.resize(sizes.bodies);
}

}  // namespace

std::filesystem::path makeSidecarPath(const std::filesystem::path& model) {
  std::filesystem::path sidecar = model;
  return sidecar.replace_extension(".walk.json");
}

Sidecar applySidecar(Model& model, std::string_view text, const std::string& source) {
  const json whole = parseJson(text, source);
  const JsonCursor cursor{whole, source};
  requireKnownKeys(cursor, {"walk", "bodies", "still", "classes", "things"});
  if (!cursor.has("walk") || whole["walk"] != 1)
    cursor.fail("must say \"walk\":1, the format's version");
  Sidecar sidecar;
  const ModelSizes before = measureModel(model);
  try {
    if (cursor.has("bodies")) readBodies(cursor.at("bodies"), model);
    if (cursor.has("still")) sidecar.staticObjects = readStaticObjects(cursor.at("still"), model);
    if (const auto reason = validateBodies(model)) throw SidecarError(source + ": " + *reason);
    if (cursor.has("classes")) readClasses(cursor.at("classes"), model);
    if (cursor.has("things")) readThings(cursor.at("things"), model);
  } catch (...) {
    truncateModel(model, before);
    throw;
  }
  return sidecar;
}

}  // namespace enfilade::scene
