#include "assets/sidecar_writer.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "assets/plan.hpp"
#include "collision/sine_cosine.hpp"

namespace enfilade::assets {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kPrefix[] = "building/";
constexpr double kDecimals = 1e6;

double roundNumber(double value) {
  return std::round(value * kDecimals) / kDecimals + 0.0;
}

Json toJsonList(const collision::Vec3& v) {
  return {roundNumber(v.x()), roundNumber(v.y()), roundNumber(v.z())};
}

std::string getBodyName(const std::string& path) {
  return path.starts_with(kPrefix) ? path.substr(sizeof kPrefix - 1) : path;
}

Json makeDoorBody(const scene::Object& object, const MovingPart& part) {
  const bool turns = part.kind == MovingPart::Kind::hinge;
  const double scale = turns ? collision::kDegreesPerRadian : 1;
  const double low = roundNumber(scale * part.low), high = roundNumber(scale * part.high);
  Json body{{"name", getBodyName(object.path)},
            {"kind", turns ? "hinged" : "sliding"},
            {"objects", {object.path}},
            {"axis", toJsonList(object.worldFromMesh.linear() * part.axis)},
            {"limits", {low, high}}};
  if (!turns) return body;  // the lift's doors are closed
  body["anchor"] = toJsonList(object.worldFromMesh.translation());
  body["closed"] = high > -low ? high : low;
  body["opened_by"] = "touch";
  return body;
}

Json makeLiftBody(const scene::Object& object, const MovingPart& part) {
  return {{"name", getBodyName(object.path)},
          {"kind", "lift"},
          {"objects", {object.path}},
          {"stops", {roundNumber(part.low), roundNumber(part.high)}},
          {"speed", kLiftSpeed},
          {"acceleration", kLiftAcceleration}};
}

/// Adds a body for the object of this path, if the model has it.
void addBody(const scene::Model& model, const std::string& path, Json body, Json& bodies) {
  const bool isThere =
      std::ranges::find(model.objects, path, &scene::Object::path) != model.objects.end();
  if (!isThere) return;  // for example in a district
  body["name"] = getBodyName(path);
  body["objects"] = {path};
  bodies.push_back(std::move(body));
}

}  // namespace

std::string makeSidecarText(const scene::Model& model, const std::vector<MovingPart>& movingParts) {
  Json bodies = Json::array();
  for (const MovingPart& part : movingParts) {
    const scene::Object& object = model.objects[part.object];
    bodies.push_back(part.isLift() ? makeLiftBody(object, part) : makeDoorBody(object, part));
  }
  const std::string study = std::string(kPrefix) + "ground/study/";
  addBody(model, study + "armchair", {{"kind", "rigid"}, {"mass", 18}}, bodies);
  addBody(model, study + "globe",
          {{"kind", "path"},
           {"keys", {{{"time", 0}}, {{"time", 12}, {"turn", 360}}}},
           {"loops", true},
           {"runs", false}},
          bodies);
  bodies.push_back({{"name", "hall/entrance"},
                    {"kind", "trigger"},
                    {"box",
                     {{plan::kHallWest, 0, -plan::kDoorHalf},
                      {plan::kHallWest + 1, plan::kDoorHeight, plan::kDoorHalf}}}});
  return Json{{"walk", 1}, {"bodies", bodies}}.dump(1) + "\n";
}

void writeSidecar(std::filesystem::path glb, const std::string& text) {
  const std::filesystem::path file = glb.replace_extension(".walk.json");
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace enfilade::assets
