#include "server/capture/capture_plan.hpp"

#include <array>
#include <cmath>
#include <fstream>
#include <sstream>

#include "scene/import/gltf/gltf_cameras.hpp"
#include "server/capture/frame_times.hpp"
#include "server/capture/script_frames.hpp"

namespace enfilade::server {
namespace {

constexpr int kWidth = 640, kHeight = 480;  // pixels
constexpr double kSameShape = 1e-3;         // of a picture's width to its height

enum class PathKind : std::uint8_t { tum, json, script, gltf };

std::string textOf(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw CameraPathError(file.string() + ": is a folder; name the file of the camera path");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw CameraPathError(file.string() + ": cannot be read; check the path");
  return std::move(text).str();
}

/// By the name; a file that is called otherwise is a walk script if its first line is JSON.
PathKind kindOf(const std::filesystem::path& file, const std::string& text) {
  const std::string extension = file.extension().string();
  if (extension == ".gltf" || extension == ".glb") return PathKind::gltf;
  if (extension == ".json") return PathKind::json;
  if (extension == ".jsonl") return PathKind::script;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos || line[first] == '#') continue;
    return line[first] == '{' || line.compare(first, 2, "//") == 0 ? PathKind::script
                                                                   : PathKind::tum;
  }
  return PathKind::tum;
}

ShotList shotsOf(const CameraPath& path) {
  ShotList list;
  for (const CameraPose& pose : path.poses) {
    Shot shot;
    shot.time = pose.time;
    shot.camera.eye = pose.eye;
    shot.camera.forward = -pose.turned.col(2);
    shot.camera.up = pose.turned.col(1);
    if (pose.fovY) shot.camera.fovY = *pose.fovY;
    list.shots.push_back(std::move(shot));
  }
  return list;
}

/// A glTF path in the model's own file stands where the model does; another file's is metres, Y up,
/// from the same origin.
ShotList gltfShots(const scene::Scene& scene, const std::filesystem::path& file,
                   const PictureOptions& options) {
  const scene::GltfCameraPath path = scene::sampleGltfCamera(file, options.camera, options.fps);
  std::error_code error;
  const bool same = std::filesystem::equivalent(file, scene.model().source, error);
  Eigen::Affine3d placed = Eigen::Affine3d::Identity();
  placed.translation() = -scene.model().offset;
  if (same) placed = scene::sceneFromFile(scene.model());
  ShotList list;
  for (const scene::GltfCameraPose& pose : path.poses) {
    Shot shot;
    shot.time = pose.time;
    shot.camera.eye = placed * pose.eye;
    shot.camera.forward = (placed.linear() * pose.forward).normalized();
    shot.camera.up = (placed.linear() * pose.up).normalized();
    shot.camera.fovY = path.fovY;
    list.shots.push_back(std::move(shot));
  }
  list.notes = path.notes;
  list.notes.insert(list.notes.begin(), "camera: " + path.name);
  return list;
}

struct Size {
  int width, height;
};

Size sizeOf(const PictureOptions& options, const std::optional<PathLens>& lens) {
  if (options.width && options.height) return {*options.width, *options.height};
  if (lens) return {lens->width, lens->height};
  return {kWidth, kHeight};
}

/// The same view in a picture of another size, of the same shape.
render::Pinhole resized(const PathLens& lens, Size size, const std::string& source) {
  const double across = static_cast<double>(size.width) / lens.width;
  const double down = static_cast<double>(size.height) / lens.height;
  if (!(std::abs(across / down - 1) <= kSameShape))
    throw CameraPathError(source + ": its lens is for pictures of " + std::to_string(lens.width) +
                          "x" + std::to_string(lens.height) + ", which " +
                          std::to_string(size.width) + "x" + std::to_string(size.height) +
                          " would distort; give --fov or --intrinsics beside --size");
  const render::Pinhole& p = lens.pinhole;
  return {p.fx * across, p.fy * down, p.cx * across, p.cy * down};
}

render::Pinhole opened(double fovX, Size size) {
  const double focal = size.width / 2.0 / std::tan(fovX / 2);
  return {focal, focal, size.width / 2.0, size.height / 2.0};
}

/// Size, lens and cuts of every camera. What the command line says goes before the path's own.
void fitLenses(std::vector<Shot>& shots, const PictureOptions& options, const CameraPath& path,
               const std::string& source) {
  for (std::size_t i = 0; i < shots.size(); ++i) {
    render::Camera& camera = shots[i].camera;
    const std::optional<PathLens> own =
        i < path.poses.size() && path.poses[i].lens ? path.poses[i].lens : path.lens;
    const Size size = sizeOf(options, path.lens ? path.lens : own);
    camera.width = size.width;
    camera.height = size.height;
    camera.near = options.near;
    camera.far = options.far;
    if (options.fovY) camera.fovY = *options.fovY;
    if (options.pinhole) {
      camera.pinhole = options.pinhole;
    } else if (own && !options.fovY) {
      camera.pinhole = resized(*own, size, source);
    } else if (path.fovX && !options.fovY) {
      camera.pinhole = opened(*path.fovX, size);
    }
    if (const auto why = render::refusal(camera))
      throw CameraPathError(source + ": frame " + std::to_string(i) + ": " + *why);
  }
}

/// Options that say nothing about a path of this kind.
void tellUnused(const PictureOptions& options, bool script, bool gltf,
                std::vector<std::string>& notes) {
  const auto tell = [&](bool given, const char* option, const char* needs) {
    if (given) notes.push_back(std::string(option) + " changes nothing: it is for " + needs);
  };
  constexpr const char* kScript = "walk scripts";
  tell(!script && options.every > 0, "--every", kScript);
  tell(!script && !options.avatar.empty(), "--avatar", kScript);
  tell(!script && options.overlay.contacts, "--overlay contacts", kScript);
  tell(!script && options.overlay.paths, "--overlay paths", kScript);
  tell(script && !options.avatar.empty() && options.every == 0, "--avatar", "--every");
  tell(script && options.still, "--still", "camera paths");
  tell(!gltf && !options.camera.empty(), "--camera", "glTF paths");
}

}  // namespace

ShotList planShots(const std::shared_ptr<const scene::Scene>& scene,
                   const std::filesystem::path& file, const PictureOptions& options,
                   const Shard& shard) {
  const std::string source = file.string();
  const std::string text = textOf(file);
  const PathKind kind = kindOf(file, text);
  CameraPath path;
  ShotList list;
  if (kind == PathKind::tum) path = parseTumPath(text, source, options.axes);
  if (kind == PathKind::json) path = parseJsonPath(text, source, options.axes, options.fps);
  if (kind == PathKind::script) {
    list = walkShots(scene, file, options, shard);
  } else {
    list = kind == PathKind::gltf ? gltfShots(*scene, file, options) : shotsOf(path);
  }
  tellUnused(options, kind == PathKind::script, kind == PathKind::gltf, list.notes);
  if (options.limit > 0 && list.shots.size() > options.limit) list.shots.resize(options.limit);
  if (kind != PathKind::script) showMoments(scene, options.still, shard, list.shots);
  fitLenses(list.shots, options, path, source);
  return list;
}

}  // namespace enfilade::server
