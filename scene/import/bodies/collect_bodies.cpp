#include "scene/import/bodies/collect_bodies.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "scene/import/bodies/body_precedence.hpp"
#include "scene/import/bodies/ifc_doors.hpp"
#include "scene/import/bodies/sidecar.hpp"

namespace enfilade::scene {
namespace {

constexpr std::size_t kLargestSidecar = std::size_t{64} << 20;  // bytes

std::string readWhole(const std::filesystem::path& file) {
  std::error_code problem;
  const auto size = std::filesystem::file_size(file, problem);
  if (!problem && size > kLargestSidecar)
    throw SidecarError(file.string() + ": is larger than 64 MiB; is it a sidecar?");
  std::ifstream stream(file, std::ios::binary);
  std::ostringstream text;
  text << stream.rdbuf();
  if (!stream || stream.bad()) throw SidecarError(file.string() + ": cannot be read");
  return text.str();
}

Sidecar applySidecarBeside(Model& model, const std::filesystem::path& file) {
  const std::filesystem::path sidecar = sidecarOf(file);
  std::error_code problem;
  if (!std::filesystem::exists(sidecar, problem)) return {};
  return applySidecar(model, readWhole(sidecar), sidecar.filename().string());
}

bool hasArea(const Mesh& mesh) {
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> Vec3 {
      return mesh.positions[mesh.indices[i + k]].cast<double>();
    };
    const Vec3 origin = corner(0);
    if ((corner(1) - origin).cross(corner(2) - origin).squaredNorm() > 0) return true;
  }
  return false;
}

/// A file that other programs wrote must not keep the scene from loading: what it calls a body and
/// has no surface to collide with stays out, told. (A sidecar's is an error.)
void dropBodiesWithoutArea(Model& model) {
  std::erase_if(model.bodies, [&](const BodySpec& body) {
    if (body.source == BodySource::sidecar) return false;
    for (const std::uint32_t index : body.objects) {
      const Object& object = model.objects[index];
      if (object.use == Object::Use::drawn) continue;
      for (const std::uint32_t mesh : object.meshes)
        if (hasArea(model.meshes[mesh])) return false;
    }
    addProblem(model, "body_without_area",
               body.name + " of " + wordOf(body.source) + ": its objects have no surface");
    return true;
  });
}

}  // namespace

void findBodies(Model& model, const std::filesystem::path& file, IfcDoors doors) {
  std::vector<BodySpec> ofFile = std::move(model.bodies), ofIfc;
  model.bodies.clear();
  // Doors are split before the sidecar is read, which may name their leaves and frames.
  ofIfc = splitDoors(model);
  const Sidecar sidecar = applySidecarBeside(model, file);
  const auto firstOfIfc =
      std::stable_partition(ofFile.begin(), ofFile.end(),
                            [](const BodySpec& body) { return body.source != BodySource::ifc; });
  ofIfc.insert(ofIfc.end(), std::make_move_iterator(firstOfIfc),
               std::make_move_iterator(ofFile.end()));
  ofFile.erase(firstOfIfc, ofFile.end());
  addLowerBodies(model, std::move(ofFile), sidecar.still);
  if (doors == IfcDoors::move) addLowerBodies(model, std::move(ofIfc), sidecar.still);
  takeCollisionShapesAlong(model);
  dropBodiesWithoutArea(model);
}

std::string sourcesOf(const Model& model) {
  std::map<BodySource, std::size_t> counts;
  for (const BodySpec& body : model.bodies) ++counts[body.source];
  std::string text;
  for (const auto& [source, count] : counts)
    text += (text.empty() ? "" : ", ") + std::to_string(count) + " of " + wordOf(source);
  return text;
}

}  // namespace enfilade::scene
