#include "scene/bodies/find_bodies.hpp"

#include <algorithm>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

#include "scene/bodies/body_precedence.hpp"
#include "scene/bodies/ifc_doors.hpp"
#include "scene/bodies/sidecar.hpp"

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
