#include "scene/bodies/find_bodies.hpp"

#include <fstream>
#include <sstream>

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

}  // namespace

void findBodies(Model& model, const std::filesystem::path& file) {
  const std::filesystem::path sidecar = sidecarOf(file);
  std::error_code problem;
  if (std::filesystem::exists(sidecar, problem))
    applySidecar(model, readWhole(sidecar), sidecar.filename().string());
}

}  // namespace enfilade::scene
