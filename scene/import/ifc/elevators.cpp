#include "scene/import/ifc/elevators.hpp"

#include <algorithm>
#include <cmath>

#include "collision/assert.hpp"
#include "scene/import/assembly/coordinates.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr double kMaxCabinHeight = 4;      // metres; taller objects include the shaft
constexpr double kMaxFloorOffset = 0.5;    // metres between a cabin's floor and its storey's
constexpr double kMinStoreySpacing = 0.3;  // metres; closer storeys count as one
constexpr double kCabinTolerance =
    0.02;                               // metres; ignores surfaces at the cabin's floor and ceiling
constexpr int kLinesPerRow = 5;         // lines per row
constexpr double kOutlineMargin = 0.1;  // fraction of the outline at each side without lines

using Corners = std::array<Vec3, 3>;

/// Heights of the storeys' floors in the scene frame, ascending and distinct.
std::vector<double> collectStoreyHeights(const Model& model, const IfcMetadata& metadata) {
  const double scale = model.metresPerUnit / metadata.metresPerUnit;
  std::vector<double> heights;
  for (const IfcProduct& product : metadata.products) {
    if (product.ifcClass != "IfcBuildingStorey" || !product.fileFromPlacement) continue;
    const Vec3 at =
        makeYUpRotation(model.upAxis) * product.fileFromPlacement->translation() * scale;
    heights.push_back(at.y() - model.offset.y());
  }
  std::sort(heights.begin(), heights.end());
  std::vector<double> distinct;
  for (const double height : heights)
    if (distinct.empty() || height - distinct.back() > kMinStoreySpacing)
      distinct.push_back(height);
  return distinct;
}

/// The triangles of other objects above or below the outline of `cabin`.
std::vector<Corners> collectShaftTriangles(const Model& model, const Object& elevator,
                                           const Aabb& cabin) {
  std::vector<Corners> found;
  for (const Object& object : model.objects) {
    if (&object == &elevator) continue;
    for (const std::uint32_t index : object.meshes) {
      const Mesh& mesh = model.meshes[index];
      for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
        Corners corners;
        Aabb box;
        for (std::size_t k = 0; k < 3; ++k) {
          corners[k] = computeWorldPosition(object, mesh, mesh.indices[i + k]);
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

/// Height at which the vertical line through (x, z) intersects the triangle.
std::optional<double> intersectVerticalLine(const Corners& t, double x, double z) {
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

/// Free distances below and above the cabin, metres.
struct ShaftClearance {
  double down, up;
};

ShaftClearance computeShaftClearance(const Model& model, const Object& elevator,
                                     const Aabb& cabin) {
  constexpr double kFar = 1e4;
  ShaftClearance clearance{kFar, kFar};
  const std::vector<Corners> triangles = collectShaftTriangles(model, elevator, cabin);
  const Vec3 size = cabin.size();
  for (int i = 0; i < kLinesPerRow * kLinesPerRow; ++i) {
    const auto toOutlineFraction = [](int k) {
      return kOutlineMargin + (1 - 2 * kOutlineMargin) * (k + 0.51) / kLinesPerRow;
    };
    const double x = cabin.min.x() + toOutlineFraction(i % kLinesPerRow) * size.x();
    const double z = cabin.min.z() + toOutlineFraction(i / kLinesPerRow) * size.z();
    for (const Corners& triangle : triangles) {
      const auto height = intersectVerticalLine(triangle, x, z);
      if (!height) continue;
      if (*height > cabin.max.y() - kCabinTolerance)
        clearance.up = std::min(clearance.up, std::max(0.0, *height - cabin.max.y()));
      if (*height < cabin.min.y() + kCabinTolerance)
        clearance.down = std::min(clearance.down, std::max(0.0, cabin.min.y() - *height));
    }
  }
  return clearance;
}

class ElevatorFinder {
 public:
  ElevatorFinder(Model& model, const IfcMetadata& metadata, std::vector<Diagnostic>& diagnostics)
      : model_(model), heights_(collectStoreyHeights(model, metadata)), diagnostics_(diagnostics) {}

  void addElevator(std::uint32_t index) {
    const Object& elevator = model_.objects[index];
    const Aabb cabin = computeObjectAabb(model_, elevator, elevator.worldFromMesh);
    if (cabin.empty()) return;
    if (cabin.size().y() > kMaxCabinHeight)
      return reportStatic(elevator, "it is taller than a cabin, so its moving part is unknown");
    ENFILADE_ASSERT(std::is_sorted(heights_.begin(), heights_.end()));
    const auto floor = std::find_if(heights_.begin(), heights_.end(), [&](double height) {
      return std::abs(height - cabin.min.y()) <= kMaxFloorOffset;
    });
    if (floor == heights_.end())
      return reportStatic(elevator, "it is not at the floor of any storey");
    const ShaftClearance clearance = computeShaftClearance(model_, elevator, cabin);
    BodySpec body;
    for (const double height : heights_) {
      const double stop = height - *floor;
      if (stop < -clearance.down - kCabinTolerance || stop > clearance.up + kCabinTolerance)
        continue;
      body.stops.push_back(stop);
    }
    if (body.stops.size() < 2)
      return reportStatic(elevator, "no open shaft leads to another storey");
    body.kind = BodyKind::lift;
    body.source = BodySource::ifc;
    body.name = elevator.path;
    body.objects = {index};
    body.anchor = cabin.centre();
    body.low = body.stops.front();
    body.high = body.stops.back();
    model_.bodies.push_back(std::move(body));
  }

 private:
  void reportStatic(const Object& elevator, const std::string& reason) {
    addDiagnostic(diagnostics_, "still_lifts",
                  elevator.path + ": " + reason + "; define it in a sidecar");
  }

  Model& model_;
  std::vector<double> heights_;
  std::vector<Diagnostic>& diagnostics_;
};

}  // namespace

void findElevators(Model& model, const IfcMetadata& metadata,
                   std::vector<Diagnostic>& diagnostics) {
  ElevatorFinder finder(model, metadata, diagnostics);
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    const bool transports =
        object.ifcClass == "IfcTransportElement" || object.ifcClass == "IfcTransportationDevice";
    if (transports && object.operationType == "ELEVATOR") finder.addElevator(i);
  }
}

}  // namespace enfilade::scene
