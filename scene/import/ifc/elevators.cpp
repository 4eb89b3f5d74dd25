// Lifts of IFC as bodies. A file places a cabin and says that it is an elevator; where it stops is
// worked out: at each storey that it reaches through an open shaft, from the one at whose floor it
// was drawn. Lines are drawn upwards and downwards from a grid of points in its outline, and what
// they meet closes the shaft.
#include <algorithm>
#include <cmath>

#include "scene/import/ifc/import_ifc.hpp"

namespace enfilade::scene {
namespace {

constexpr double kTallest = 4;      // metres: what is taller is no cabin but the shaft with it
constexpr double kAtFloor = 0.5;    // metres between a cabin's floor and its storey's
constexpr double kSameFloor = 0.3;  // metres: storeys that are nearer are one
constexpr double kBeside = 0.02;    // metres: the cabin's own floor and ceiling are not in its way
constexpr int kGrid = 5;            // lines in a row
constexpr double kOutline = 0.1;    // part of the outline at each side that no line goes through

using Corners = std::array<Vec3, 3>;

Box boxOf(const Model& model, const Object& object) {
  Box box;
  for (const std::uint32_t mesh : object.meshes)
    for (const std::uint32_t i : model.meshes[mesh].indices)
      box.include(worldPosition(object, model.meshes[mesh], i));
  return box;
}

/// Heights of the storeys' floors in the scene, ascending, each once.
std::vector<double> storeyHeights(const Model& model, const IfcFacts& facts) {
  const double scale = model.metresPerUnit / facts.metresPerUnit;
  std::vector<double> heights;
  for (const IfcProduct& product : facts.products) {
    if (product.ifcClass != "IfcBuildingStorey" || !product.fileFromPlacement) continue;
    const Vec3 at = yUpFrom(model.up) * product.fileFromPlacement->translation() * scale;
    heights.push_back(at.y() - model.offset.y());
  }
  std::sort(heights.begin(), heights.end());
  std::vector<double> apart;
  for (const double height : heights)
    if (apart.empty() || height - apart.back() > kSameFloor) apart.push_back(height);
  return apart;
}

/// The triangles of other objects over or under the outline of `cabin`.
std::vector<Corners> trianglesInShaft(const Model& model, const Object& lift, const Box& cabin) {
  std::vector<Corners> found;
  for (const Object& object : model.objects) {
    if (&object == &lift) continue;
    for (const std::uint32_t index : object.meshes) {
      const Mesh& mesh = model.meshes[index];
      for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        Corners corners;
        Box box;
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = worldPosition(object, mesh, mesh.indices[i + k]);
          box.include(corners[k]);
        }
        box.min.y() = cabin.min.y();
        box.max.y() = cabin.max.y();
        if (collision::overlaps(box, cabin)) found.push_back(corners);
      }
    }
  }
  return found;
}

/// Where the vertical line through (x, z) meets the triangle.
std::optional<double> heightAt(const Corners& t, double x, double z) {
  std::array<double, 3> weight;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 &a = t[(i + 1) % 3], &b = t[(i + 2) % 3];
    weight[i] = (b.x() - a.x()) * (z - a.z()) - (b.z() - a.z()) * (x - a.x());
  }
  const double sum = weight[0] + weight[1] + weight[2];
  const bool left = weight[0] >= 0 && weight[1] >= 0 && weight[2] >= 0;
  const bool right = weight[0] <= 0 && weight[1] <= 0 && weight[2] <= 0;
  if (sum == 0 || (!left && !right)) return std::nullopt;
  return (weight[0] * t[0].y() + weight[1] * t[1].y() + weight[2] * t[2].y()) / sum;
}

/// How far the cabin can go down and up, metres.
struct Room {
  double down, up;
};

Room roomOf(const Model& model, const Object& lift, const Box& cabin) {
  constexpr double kFar = 1e4;
  Room room{kFar, kFar};
  const std::vector<Corners> triangles = trianglesInShaft(model, lift, cabin);
  const Vec3 size = cabin.size();
  for (int i = 0; i < kGrid * kGrid; ++i) {
    const auto part = [](int k) { return kOutline + (1 - 2 * kOutline) * (k + 0.51) / kGrid; };
    const double x = cabin.min.x() + part(i % kGrid) * size.x();
    const double z = cabin.min.z() + part(i / kGrid) * size.z();
    for (const Corners& triangle : triangles) {
      const auto height = heightAt(triangle, x, z);
      if (!height) continue;
      if (*height > cabin.max.y() - kBeside)
        room.up = std::min(room.up, std::max(0.0, *height - cabin.max.y()));
      if (*height < cabin.min.y() + kBeside)
        room.down = std::min(room.down, std::max(0.0, cabin.min.y() - *height));
    }
  }
  return room;
}

class LiftFinder {
 public:
  LiftFinder(Model& model, const IfcFacts& facts, ProblemLog& problems)
      : model_(model), heights_(storeyHeights(model, facts)), problems_(problems) {}

  void find(std::uint32_t index) {
    const Object& lift = model_.objects[index];
    const Box cabin = boxOf(model_, lift);
    if (cabin.empty()) return;
    if (cabin.size().y() > kTallest)
      return stay(lift, "it is taller than a cabin: what of it moves is not said");
    const auto floor = std::find_if(heights_.begin(), heights_.end(), [&](double height) {
      return std::abs(height - cabin.min.y()) <= kAtFloor;
    });
    if (floor == heights_.end()) return stay(lift, "it stands at no storey's floor");
    const Room room = roomOf(model_, lift, cabin);
    BodySpec body;
    for (const double height : heights_) {
      const double stop = height - *floor;
      if (stop < -room.down - kBeside || stop > room.up + kBeside) continue;
      body.stops.push_back(stop);
    }
    if (body.stops.size() < 2) return stay(lift, "no other storey is open to it, up or down");
    body.kind = BodyKind::lift;
    body.source = BodySource::ifc;
    body.name = lift.path;
    body.objects = {index};
    body.anchor = cabin.centre();
    body.low = body.stops.front();
    body.high = body.stops.back();
    model_.bodies.push_back(std::move(body));
  }

 private:
  void stay(const Object& lift, const std::string& why) {
    problems_.add("still_lifts", lift.path + ": " + why + "; a sidecar can say it");
  }

  Model& model_;
  std::vector<double> heights_;
  ProblemLog& problems_;
};

}  // namespace

void findLifts(Model& model, const IfcFacts& facts, ProblemLog& problems) {
  LiftFinder finder(model, facts, problems);
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    const bool transports =
        object.ifcClass == "IfcTransportElement" || object.ifcClass == "IfcTransportationDevice";
    if (transports && object.operation == "ELEVATOR") finder.find(i);
  }
}

}  // namespace enfilade::scene
