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

#include "render/image/image.hpp"
#include "server/capture/frame_files.hpp"
#include "server/capture/metadata_files.hpp"

namespace enfilade::server {
namespace {

namespace fs = std::filesystem;

/// A file being written is younger: another machine's shard may be at it in the same folder.
constexpr std::chrono::seconds kHalfWritten{60};

void write(const fs::path& file, const std::string& text) {
  render::writeFileWhole(file, text.data(), text.size());
}

std::optional<std::string> textOf(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return std::nullopt;
  return std::string(std::istreambuf_iterator<char>(in), {});
}

bool holdsFiles(const fs::path& folder) {
  std::error_code error;
  return fs::directory_iterator(folder, error) != fs::directory_iterator();
}

/// render::writeFileWhole() calls a file that is not whole yet NAME.part-PID-N.
bool leftHalfWritten(const fs::directory_entry& entry) {
  const std::string name = entry.path().filename().string();
  const std::size_t part = name.find(".part-");
  if (part == std::string::npos) return false;
  pid_t writer = 0;
  const char* digits = name.data() + part + 6;
  if (std::from_chars(digits, name.data() + name.size(), writer).ec != std::errc() || writer <= 0)
    return false;
  std::error_code error;
  const auto age = fs::file_time_type::clock::now() - entry.last_write_time(error);
  return !error && age > kHalfWritten && ::kill(writer, 0) != 0 && errno == ESRCH;
}

void removeHalfWritten(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (leftHalfWritten(entry)) fs::remove(entry.path(), error);
}

}  // namespace

void prepareFolder(const fs::path& folder) {
  const fs::path probe = folder / ".writable";
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && !std::ofstream(probe).put(' ').flush())
    error = std::error_code(errno, std::generic_category());
  if (error)
    throw std::runtime_error("cannot write into " + folder.string() + ": " + error.message() +
                             "; give another folder with --out");
  fs::remove(probe, error);
}

void claimFolder(const fs::path& folder, const PictureOptions& options,
                 const std::string& manifest) {
  const std::string remedy = "; give another folder with --out, or remove what is in this one";
  const std::optional<std::string> there = textOf(folder / kManifest);
  const std::string difference = there ? manifestDifference(*there, manifest) : "";
  if (!difference.empty())
    throw std::runtime_error(folder.string() + " holds another capture (" + difference + ")" +
                             remedy);
  for (const fs::path& channel : foldersOf(options)) {
    if (!there && holdsFiles(folder / channel))
      throw std::runtime_error((folder / channel).string() + " holds files, but there is no " +
                               kManifest + " that says whose" + remedy);
    fs::create_directories(folder / channel);
    removeHalfWritten(folder / channel);
  }
  removeHalfWritten(folder);
  if (!there) write(folder / kManifest, manifest);
}

void disclaimFolder(const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error))
    if (entry.is_directory(error) && holdsFiles(entry.path())) return;
  fs::remove(folder / kManifest, error);
}

void writeDocuments(const fs::path& folder, const scene::Scene& scene, const ShotList& list,
                    const PictureOptions& options) {
  write(folder / "instances.json", instancesJson(scene.model(), list.walkers));
  write(folder / "transforms.json", transformsJson(list.shots, options, scene.model()));
  if (options.layout != FolderLayout::tum) return;
  std::size_t channel = 0;
  if (options.channels.rgb)
    write(folder / "rgb.txt", tumFileList(list.shots, options, channel++, "color images"));
  if (options.channels.depth)
    write(folder / "depth.txt", tumFileList(list.shots, options, channel, "depth maps"));
  write(folder / "groundtruth.txt", tumGroundTruth(list.shots));
}

}  // namespace enfilade::server
