#include "assets/sidecar_writer.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "assets/plan.hpp"

namespace enfilade::assets {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kPrefix[] = "building/";
constexpr double kDegreesPerRadian = 57.29577951308232;
constexpr double kDecimals = 1e6;

double rounded(double value) {
  return std::round(value * kDecimals) / kDecimals + 0.0;
}

Json listOf(const collision::Vec3& v) {
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

std::string nameOf(const std::string& path) {
  return path.starts_with(kPrefix) ? path.substr(sizeof kPrefix - 1) : path;
}

Json doorOf(const scene::Object& object, const MovingPart& part) {
  const bool turns = part.kind == MovingPart::Kind::hinge;
  const double scale = turns ? kDegreesPerRadian : 1;
  const double low = rounded(scale * part.low), high = rounded(scale * part.high);
  Json body{{"name", nameOf(object.path)},
            {"kind", turns ? "hinged" : "sliding"},
            {"objects", {object.path}},
            {"axis", listOf(object.worldFromMesh.linear() * part.axis)},
            {"limits", {low, high}}};
  if (!turns) return body;  // the lift's doors are closed
  body["anchor"] = listOf(object.worldFromMesh.translation());
  body["closed"] = high > -low ? high : low;
  body["opened_by"] = "touch";
  return body;
}

Json liftOf(const scene::Object& object, const MovingPart& part) {
  return {{"name", nameOf(object.path)}, {"kind", "lift"},
          {"objects", {object.path}},    {"stops", {rounded(part.low), rounded(part.high)}},
          {"speed", kLiftSpeed},         {"acceleration", kLiftAcceleration}};
}

/// Adds a body for the object of this path, if the model has it.
void addBodyOf(const scene::Model& model, const std::string& path, Json body, Json& bodies) {
  const bool isThere =
      std::ranges::find(model.objects, path, &scene::Object::path) != model.objects.end();
  if (!isThere) return;  // for example in a district
  body["name"] = nameOf(path);
  body["objects"] = {path};
  bodies.push_back(std::move(body));
}

}  // namespace

std::string sidecarText(const scene::Model& model, const std::vector<MovingPart>& movingParts) {
  Json bodies = Json::array();
  for (const MovingPart& part : movingParts) {
    const scene::Object& object = model.objects[part.object];
    bodies.push_back(part.isLift() ? liftOf(object, part) : doorOf(object, part));
  }
  const std::string study = std::string(kPrefix) + "ground/study/";
  addBodyOf(model, study + "armchair", {{"kind", "rigid"}, {"mass", 18}}, bodies);
  addBodyOf(model, study + "globe",
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

void writeSidecarOf(std::filesystem::path glb, const std::string& text) {
  const std::filesystem::path file = glb.replace_extension(".walk.json");
  std::ofstream stream(file, std::ios::binary);
  stream << text;
  if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
}

}  // namespace enfilade::assets
