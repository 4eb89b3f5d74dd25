#include "server/capture/capture_folder.hpp"

#include <signal.h>

#include <cerrno>
#include <charconv>
#include <chrono>
#include <fstream>
#include <iterator>
#include <optional>
#include <stdexcept>
#include <system_error>

#include "render/image/atomic_file.hpp"
#include "server/capture/frame_files.hpp"
#include "server/capture/metadata_files.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

/// Age of an abandoned part file. Younger ones may belong to a shard on another machine.
constexpr std::chrono::seconds kStalePartFileAge{60};

std::optional<std::string> readText(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

bool containsFiles(const fs::path& folder) {
  std::error_code error;
  return fs::directory_iterator(folder, error) != fs::directory_iterator();
}

/// True for an abandoned NAME.part-PID-N, the temporary file of render::writeFileAtomically().
bool isStalePartFile(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const std::size_t part = name.find(".part-");
  if (part == std::string::npos) return false;
  pid_t writer = 0;
  const char* digits = name.data() + part + 6;
  if (std::from_chars(digits, name.data() + name.size(), writer).ec != std::errc() || writer <= 0)
    return false;
  std::error_code error;
  const auto age = fs::file_time_type::clock::now() - entry.last_write_time(error);
  return !error && age > kStalePartFileAge && ::kill(writer, 0) != 0 && errno == ESRCH;
}

void removeStalePartFiles(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (isStalePartFile(entry)) fs::remove(entry.path(), error);
}

}  // namespace

void claimFolder(const fs::path& folder, const PictureOptions& options,
                 const std::string& manifest) {
  const std::string remedy = "; give another folder with --out, or empty this one";
  const std::optional<std::string> existing = readText(folder / kManifestName);
  const std::string difference = existing ? compareManifests(*existing, manifest) : "";
  if (!difference.empty())
    throw std::runtime_error(folder.string() + " contains another capture (" + difference + ")" +
                             remedy);
  for (const fs::path& channel : listFrameFolders(options)) {
    if (!existing && containsFiles(folder / channel))
      throw std::runtime_error((folder / channel).string() + " contains files, but there is no " +
                               kManifestName + " that identifies them" + remedy);
    fs::create_directories(folder / channel);
    removeStalePartFiles(folder / channel);
  }
  removeStalePartFiles(folder);
  if (!existing) render::writeFileAtomically(folder / kManifestName, manifest);
}

void releaseFolder(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.is_directory(error) && containsFiles(entry.path())) return;
  fs::remove(folder / kManifestName, error);
}

void writeMetadataFiles(const fs::path& folder, const scene::Scene& scene, const CapturePlan& plan,
                        const PictureOptions& options) {
  render::writeFileAtomically(folder / "instances.json",
                              makeInstancesJson(scene.model(), plan.avatars));
  render::writeFileAtomically(folder / "transforms.json",
                              makeTransformsJson(plan.frames, options, scene.model()));
  if (options.layout != FolderLayout::tum) return;
  std::size_t channel = 0;
  if (options.channels.rgb)
    render::writeFileAtomically(folder / "rgb.txt",
                                makeTumFileList(plan.frames, options, channel++, "color images"));
  if (options.channels.depth)
    render::writeFileAtomically(folder / "depth.txt",
                                makeTumFileList(plan.frames, options, channel, "depth maps"));
  render::writeFileAtomically(folder / "groundtruth.txt", makeTumGroundTruth(plan.frames));
}

}  // namespace enfilade::server
