#include "tests/accuracy/case_file.hpp"

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace enfilade::accuracy {
namespace {

using Json = nlohmann::json;

Vec3 toVector(const Json& json) {
  return {json.at(0).get<double>(), json.at(1).get<double>(), json.at(2).get<double>()};
}

/// Calls `use(object)` for each line that is not empty.
template <typename Use>
void forEachObject(const std::filesystem::path& file, const Use& use) {
  std::ifstream lines(file);
  if (!lines) throw std::runtime_error(file.string() + ": cannot be opened");
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      use(Json::parse(line));
    } catch (const std::exception& error) {
      throw std::runtime_error(file.string() + ":" + std::to_string(number) + ": " + error.what());
    }
  }
}

bool has(const Json& json, const char* key) {
  return json.contains(key) && !json.at(key).is_null();
}

std::string getText(const Json& json, const char* key) {
  if (!has(json, key)) return {};
  return json.at(key).is_string() ? json.at(key).get<std::string>() : json.at(key).dump();
}

Placed parsePlaced(const Json& points, const Json& pose) {
  Placed body;
  for (const Json& p : points) body.points.push_back(toVector(p));
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column)
      body.rotation(row, column) = pose.at(4 * row + column).get<double>();
    body.translation[row] = pose.at(4 * row + 3).get<double>();
  }
  return body;
}

std::vector<std::uint32_t> parseAscending(const Json& json, const char* key) {
  std::vector<std::uint32_t> list;
  if (has(json, key)) list = json.at(key).get<std::vector<std::uint32_t>>();
  std::sort(list.begin(), list.end());
  return list;
}

Truth parseTruth(const Json& json) {
  Truth truth;
  truth.verdict = getText(json, "verdict");
  truth.distance = getText(json, "distance");
  truth.penetration = getText(json, "penetration");
  truth.tc = getText(json, "tc");
  if (has(json, "near")) truth.near = json.at("near").get<bool>();
  if (has(json, "toi")) truth.toi = json.at("toi").get<std::array<double, 2>>();
  truth.penetrated = parseAscending(json, "penetrated_triangles");
  truth.touched = parseAscending(json, "touched_triangles");
  return truth;
}

Case parseCase(const Json& json) {
  Case result;
  result.id = getText(json, "id");
  result.family = getText(json, "family");
  result.a = parsePlaced(json.at("a"), json.at("pose_a"));
  result.mesh = getText(json, "mesh");
  if (result.mesh.empty()) result.b = parsePlaced(json.at("b"), json.at("pose_b"));
  if (has(json, "eps")) result.clearance = json.at("eps").get<double>();
  if (has(json, "seq")) result.sequence = json.at("seq").get<long>();
  if (has(json, "vel")) {
    result.course = Course{toVector(json.at("vel")), Vec3::Zero()};
    if (has(json, "acc")) result.course->acceleration = toVector(json.at("acc"));
  }
  result.truth = parseTruth(json);
  return result;
}

}  // namespace

std::vector<Case> readCases(const std::filesystem::path& file) {
  std::vector<Case> cases;
  forEachObject(file, [&](const Json& json) { cases.push_back(parseCase(json)); });
  return cases;
}

Meshes readMeshes(const std::filesystem::path& file) {
  Meshes meshes;
  forEachObject(file, [&](const Json& json) {
    std::vector<Triangle>& triangles = meshes[json.at("mesh").get<std::string>()];
    const Json& vertices = json.at("v");
    for (const Json& f : json.at("f"))
      triangles.push_back({toVector(vertices.at(f.at(0).get<std::size_t>())),
                           toVector(vertices.at(f.at(1).get<std::size_t>())),
                           toVector(vertices.at(f.at(2).get<std::size_t>()))});
  });
  return meshes;
}

}  // namespace enfilade::accuracy
