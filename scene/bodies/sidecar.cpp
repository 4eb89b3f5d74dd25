#include "scene/bodies/sidecar.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>

#include "scene/scene.hpp"

namespace enfilade::scene {
namespace {

using nlohmann::json;

constexpr double kRadiansPerDegree = 0.017453292519943295;
constexpr std::size_t kMostBodies = 100000;

/// A value of the file and its place in it.
struct Place {
  const json& value;
  std::string name;

  [[noreturn]] void fail(const std::string& what) const { throw SidecarError(name + ": " + what); }
  Place at(const char* key) const { return {value.at(key), name + "." + key}; }
  Place at(std::size_t i) const { return {value.at(i), name + "[" + std::to_string(i) + "]"}; }
  bool has(const char* key) const { return value.contains(key); }
};

std::string excerpt(const json& value) {
  const std::string text = value.dump(-1, ' ', false, json::error_handler_t::replace);
  return text.size() > 40 ? text.substr(0, 37) + "..." : text;
}

double number(const Place& place) {
  if (!place.value.is_number()) place.fail("must be a number, not " + excerpt(place.value));
  return place.value.get<double>();
}

bool truth(const Place& place) {
  if (!place.value.is_boolean()) place.fail("must be true or false, not " + excerpt(place.value));
  return place.value.get<bool>();
}

std::string text(const Place& place) {
  if (!place.value.is_string() || place.value.get<std::string>().empty())
    place.fail("must be a text, not " + excerpt(place.value));
  return place.value.get<std::string>();
}

std::vector<double> numbers(const Place& place) {
  if (!place.value.is_array()) place.fail("must be a list of numbers, not " + excerpt(place.value));
  std::vector<double> all;
  for (std::size_t i = 0; i < place.value.size(); ++i) all.push_back(number(place.at(i)));
  return all;
}

Vec3 vector(const Place& place) {
  const std::vector<double> xyz = numbers(place);
  if (xyz.size() != 3) place.fail("must be three numbers, not " + excerpt(place.value));
  return {xyz[0], xyz[1], xyz[2]};
}

void allowOnly(const Place& place, std::initializer_list<const char*> keys) {
  if (!place.value.is_object()) place.fail("must be an object, not " + excerpt(place.value));
  for (const auto& [key, value] : place.value.items()) {
    const bool known = std::any_of(keys.begin(), keys.end(),
                                   [k = key](const char* allowed) { return k == allowed; });
    if (known) continue;
    std::string all;
    for (const char* allowed : keys) all += (all.empty() ? "" : ", ") + std::string(allowed);
    place.fail("unknown key " + excerpt(key) + "; known here are " + all);
  }
}

// ---- objects -----------------------------------------------------------------------------------

/// Objects of that path or GlobalId; a path that ends in * stands for all that begin so.
std::vector<std::uint32_t> objectsOf(const Place& place, const Model& model) {
  const std::string wanted = text(place);
  const bool open = wanted.back() == '*';
  const std::string_view stem(wanted.data(), wanted.size() - (open ? 1 : 0));
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    const bool same =
        open ? object.path.starts_with(stem) : object.path == wanted || object.globalId == wanted;
    if (same) found.push_back(i);
  }
  if (found.empty())
    place.fail("there is no object " + excerpt(place.value) +
               (model.objects.empty() ? "" : "; the first one is '" + model.objects[0].path + "'"));
  return found;
}

std::vector<std::uint32_t> listOfObjects(const Place& place, const Model& model) {
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

/// Reads the keys that are there; `scale` is radians per degree for what turns.
void readMotion(const Place& place, BodySpec& body, double scale) {
  if (place.has("limits")) {
    const std::vector<double> limits = numbers(place.at("limits"));
    if (limits.size() != 2) place.at("limits").fail("must be two numbers");
    body.low = scale * limits[0];
    body.high = scale * limits[1];
  }
  if (place.has("closed")) body.closed = scale * number(place.at("closed"));
  if (place.has("speed")) body.speed = scale * number(place.at("speed"));
  if (place.has("acceleration")) body.acceleration = scale * number(place.at("acceleration"));
  if (place.has("closes_after")) body.closesAfter = number(place.at("closes_after"));
  if (!place.has("opened_by")) return;
  const std::string by = text(place.at("opened_by"));
  if (by != "touch" && by != "command")
    place.at("opened_by").fail("must be \"touch\" or \"command\"");
  body.openedBy = by == "touch" ? OpenedBy::touch : OpenedBy::command;
}

void readAxis(const Place& place, BodySpec& body, const Model& model, bool anchorIsNeeded) {
  if (place.has("axis")) {
    const Vec3 axis = vector(place.at("axis"));
    if (!(axis.norm() > 1e-6) || !axis.allFinite()) place.at("axis").fail("has no direction");
    body.axis = axis.normalized();
  }
  if (place.has("anchor")) {
    body.anchor = vector(place.at("anchor"));
  } else if (anchorIsNeeded) {
    place.fail("anchor is missing: a point of the axis, [x,y,z]");
  } else if (const Box box = boxOf(model, body.objects); !box.empty()) {
    body.anchor = box.centre();
  }
}

void readHinged(const Place& place, BodySpec& body, const Model& model) {
  allowOnly(place, {"name", "kind", "objects", "anchor", "axis", "limits", "closed", "speed",
                    "acceleration", "closes_after", "opened_by"});
  readAxis(place, body, model, true);
  body.high = 90 * kRadiansPerDegree;
  body.speed = 90 * kRadiansPerDegree;
  readMotion(place, body, kRadiansPerDegree);
}

void readSliding(const Place& place, BodySpec& body, const Model& model) {
  allowOnly(place, {"name", "kind", "objects", "anchor", "axis", "limits", "closed", "speed",
                    "acceleration", "closes_after", "opened_by"});
  if (!place.has("limits")) place.fail("limits is missing: [from, to] in metres along the axis");
  body.axis = Vec3::UnitX();
  readAxis(place, body, model, false);
  readMotion(place, body, 1);
}

void readLift(const Place& place, BodySpec& body, const Model& model) {
  allowOnly(place, {"name", "kind", "objects", "axis", "stops", "speed", "acceleration"});
  if (!place.has("stops"))
    place.fail("stops is missing: a list of metres along the axis, as [0,3]");
  readAxis(place, body, model, false);
  body.stops = numbers(place.at("stops"));
  for (const double stop : body.stops) {
    body.low = std::min(body.low, stop);
    body.high = std::max(body.high, stop);
  }
  readMotion(place, body, 1);
}

void readPath(const Place& place, BodySpec& body, const Model& model) {
  allowOnly(place, {"name", "kind", "objects", "anchor", "axis", "keys", "speed", "loops", "runs"});
  readAxis(place, body, model, false);
  if (!place.has("keys") || !place.value.at("keys").is_array())
    place.fail("keys is missing: a list of {\"time\":s,\"offset\":[x,y,z],\"turn\":degrees}");
  const Place keys = place.at("keys");
  for (std::size_t i = 0; i < keys.value.size(); ++i) {
    const Place key = keys.at(i);
    allowOnly(key, {"time", "offset", "turn"});
    PathKey read;
    if (!key.has("time")) key.fail("time is missing: seconds since the path began");
    read.time = number(key.at("time"));
    if (key.has("offset")) read.offset = vector(key.at("offset"));
    if (key.has("turn")) read.turn = kRadiansPerDegree * number(key.at("turn"));
    body.keys.push_back(read);
  }
  if (place.has("speed")) body.speed = number(place.at("speed"));
  if (place.has("loops")) body.loops = truth(place.at("loops"));
  if (place.has("runs")) body.runs = truth(place.at("runs"));
}

void readRigid(const Place& place, BodySpec& body) {
  allowOnly(place,
            {"name", "kind", "objects", "each", "density", "mass", "friction", "restitution"});
  if (place.has("density")) body.density = number(place.at("density"));
  if (place.has("mass")) body.mass = number(place.at("mass"));
  if (place.has("friction")) body.friction = number(place.at("friction"));
  if (place.has("restitution")) body.restitution = number(place.at("restitution"));
}

void readTrigger(const Place& place, BodySpec& body, Model& model) {
  allowOnly(place, {"name", "kind", "objects", "box"});
  if (!place.has("box")) return;
  const Place box = place.at("box");
  if (!box.value.is_array() || box.value.size() != 2)
    box.fail("must be two corners, [[x,y,z],[x,y,z]]");
  const Vec3 a = vector(box.at(std::size_t{0})), b = vector(box.at(std::size_t{1}));
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

void readBody(const Place& place, Model& model) {
  if (!place.value.is_object()) place.fail("must be an object, not " + excerpt(place.value));
  for (const char* key : {"name", "kind"})
    if (!place.has(key)) place.fail(std::string(key) + " is missing");
  BodySpec body;
  body.source = BodySource::sidecar;
  body.name = text(place.at("name"));
  const std::string kind = text(place.at("kind"));
  if (place.has("objects")) body.objects = listOfObjects(place.at("objects"), model);
  if (!place.has("objects") && !place.has("box"))
    place.fail("objects is missing: a list of paths or GlobalIds");
  if (kind == "hinged") {
    body.kind = BodyKind::hinged;
    readHinged(place, body, model);
  } else if (kind == "sliding") {
    body.kind = BodyKind::sliding;
    readSliding(place, body, model);
  } else if (kind == "lift") {
    body.kind = BodyKind::lift;
    readLift(place, body, model);
  } else if (kind == "path") {
    body.kind = BodyKind::path;
    readPath(place, body, model);
  } else if (kind == "rigid") {
    body.kind = BodyKind::rigid;
    readRigid(place, body);
    if (place.has("each") && truth(place.at("each"))) return addEach(model, body);
  } else if (kind == "trigger") {
    body.kind = BodyKind::trigger;
    readTrigger(place, body, model);
  } else {
    place.at("kind").fail("must be hinged, sliding, lift, path, rigid or trigger, not " +
                          excerpt(place.value.at("kind")));
  }
  model.bodies.push_back(std::move(body));
}

void readBodies(const Place& bodies, Model& model) {
  if (!bodies.value.is_array()) bodies.fail("must be a list, not " + excerpt(bodies.value));
  if (bodies.value.size() > kMostBodies) bodies.fail("has too many entries");
  for (std::size_t i = 0; i < bodies.value.size(); ++i) readBody(bodies.at(i), model);
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

json parse(std::string_view text, const std::string& source) {
  try {
    return json::parse(text);
  } catch (const json::exception& problem) {
    throw SidecarError(source + ": is not JSON: " + problem.what());
  }
}

}  // namespace

std::filesystem::path sidecarOf(const std::filesystem::path& model) {
  std::filesystem::path sidecar = model;
  return sidecar.replace_extension(".walk.json");
}

Sidecar applySidecar(Model& model, std::string_view text, const std::string& source) {
  const json whole = parse(text, source);
  const Place place{whole, source};
  allowOnly(place, {"walk", "bodies", "still"});
  if (!place.has("walk") || whole["walk"] != 1)
    place.fail("must say \"walk\":1, the format's version");
  Sidecar sidecar;
  const Extent before = extentOf(model);
  try {
    if (place.has("bodies")) readBodies(place.at("bodies"), model);
    if (place.has("still"))
      for (const std::uint32_t object : listOfObjects(place.at("still"), model))
        sidecar.still.insert(object);
    if (const auto why = refusalOfBodies(model)) throw SidecarError(source + ": " + *why);
  } catch (...) {
    cutBack(model, before);
    throw;
  }
  return sidecar;
}

}  // namespace enfilade::scene
