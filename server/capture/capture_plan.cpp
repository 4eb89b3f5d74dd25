#include "server/capture/capture_plan.hpp"

#include <cmath>
#include <fstream>
#include <sstream>

#include "scene/import/gltf/gltf_cameras.hpp"
#include "server/capture/frame_times.hpp"
#include "server/capture/path/json_path.hpp"
#include "server/capture/path/tum_path.hpp"
#include "server/capture/script_frames.hpp"

namespace enfilade::server {
namespace {

constexpr int kDefaultWidth = 640, kDefaultHeight = 480;  // pixels
constexpr double kAspectTolerance = 1e-3;                 // relative, of width / height

enum class PathKind : std::uint8_t { tum, json, script, gltf };

/// Detects the kind by the extension; for other names, a walk script has JSON in its first line.
PathKind detectPathKind(const std::filesystem::path& file, const std::string& text) {
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

CapturePlan makePathPlan(const CameraPath& path) {
  CapturePlan plan;
  for (const CameraPose& pose : path.poses) {
    CaptureFrame captureFrame;
    captureFrame.time = pose.time;
    captureFrame.camera.eye = pose.eye;
    captureFrame.camera.forward = -pose.rotation.col(2);
    captureFrame.camera.up = pose.rotation.col(1);
    if (pose.fovY) captureFrame.camera.fovY = *pose.fovY;
    plan.frames.push_back(std::move(captureFrame));
  }
  return plan;
}

/// Makes the plan of a glTF camera. A camera in the model's file uses the model's import transform;
/// another file uses metres, Y up, with the scene's origin.
CapturePlan makeGltfPlan(const scene::Scene& scene, const std::filesystem::path& file,
                         const PictureOptions& options) {
  const scene::GltfCameraPath path = scene::sampleGltfCamera(file, options.camera, options.fps);
  std::error_code error;
  const bool same = std::filesystem::equivalent(file, scene.model().source, error);
  Eigen::Affine3d sceneFromFile = Eigen::Affine3d::Identity();
  sceneFromFile.translation() = -scene.model().offset;
  if (same) sceneFromFile = scene::computeSceneFromFile(scene.model());
  CapturePlan plan;
  for (const scene::GltfCameraPose& pose : path.poses) {
    CaptureFrame captureFrame;
    captureFrame.time = pose.time;
    captureFrame.camera.eye = sceneFromFile * pose.eye;
    captureFrame.camera.forward = (sceneFromFile.linear() * pose.forward).normalized();
    captureFrame.camera.up = (sceneFromFile.linear() * pose.up).normalized();
    captureFrame.camera.fovY = path.fovY;
    plan.frames.push_back(std::move(captureFrame));
  }
  plan.notes = path.notes;
  plan.notes.insert(plan.notes.begin(), "camera: " + path.name);
  return plan;
}

struct Size {
  int width, height;
};

Size chooseSize(const PictureOptions& options, const std::optional<PathLens>& lens) {
  if (options.width && options.height) return {*options.width, *options.height};
  if (lens) return {lens->width, lens->height};
  return {kDefaultWidth, kDefaultHeight};
}

/// Scales a lens to another picture size with the same aspect ratio.
render::Pinhole resizeLens(const PathLens& lens, Size size, const std::string& source) {
  const double scaleX = static_cast<double>(size.width) / lens.width;
  const double scaleY = static_cast<double>(size.height) / lens.height;
  if (!(std::abs(scaleX / scaleY - 1) <= kAspectTolerance))
    throw CameraPathError(source + ": its lens is for pictures of " + std::to_string(lens.width) +
                          "x" + std::to_string(lens.height) + ", which " +
                          std::to_string(size.width) + "x" + std::to_string(size.height) +
                          " would distort; give --fov or --intrinsics with --size");
  const render::Pinhole& p = lens.pinhole;
  return {p.fx * scaleX, p.fy * scaleY, p.cx * scaleX, p.cy * scaleY};
}

render::Pinhole makePinhole(double fovX, Size size) {
  const double focal = size.width / 2.0 / std::tan(fovX / 2);
  return {focal, focal, size.width / 2.0, size.height / 2.0};
}

/// Sets size, lens and clip distances of all cameras. Options override the path.
void applyLenses(std::vector<CaptureFrame>& captureFrames, const PictureOptions& options,
                 const CameraPath& path, const std::string& source) {
  for (std::size_t i = 0; i < captureFrames.size(); ++i) {
    render::Camera& camera = captureFrames[i].camera;
    const std::optional<PathLens> own =
        i < path.poses.size() && path.poses[i].lens ? path.poses[i].lens : path.lens;
    const Size size = chooseSize(options, path.lens ? path.lens : own);
    camera.width = size.width;
    camera.height = size.height;
    camera.near = options.near;
    camera.far = options.far;
    if (options.fovY) camera.fovY = *options.fovY;
    if (options.pinhole) {
      camera.pinhole = options.pinhole;
    } else if (own && !options.fovY) {
      camera.pinhole = resizeLens(*own, size, source);
    } else if (path.fovX && !options.fovY) {
      camera.pinhole = makePinhole(*path.fovX, size);
    }
    if (const auto problem = render::validateCamera(camera))
      throw CameraPathError(source + ": frame " + std::to_string(i) + ": " + *problem);
  }
}

/// Adds notes about options without effect for this kind of path.
void noteUnusedOptions(const PictureOptions& options, bool script, bool gltf,
                       std::vector<std::string>& notes) {
  const auto noteIf = [&](bool given, const char* option, const char* needs) {
    if (given) notes.push_back(std::string(option) + " has no effect: it is for " + needs);
  };
  constexpr const char* kScript = "walk scripts";
  noteIf(!script && options.every > 0, "--every", kScript);
  noteIf(!script && !options.avatar.empty(), "--avatar", kScript);
  noteIf(!script && options.overlay.contacts, "--overlay contacts", kScript);
  noteIf(!script && options.overlay.paths, "--overlay paths", kScript);
  noteIf(script && !options.avatar.empty() && options.every == 0, "--avatar", "--every");
  noteIf(script && options.freezeScene, "--still", "camera paths");
  noteIf(!gltf && !options.camera.empty(), "--camera", "glTF paths");
}

}  // namespace

std::string readPathFile(const std::filesystem::path& file) {
  std::error_code error;
  if (std::filesystem::is_directory(file, error))
    throw CameraPathError(file.string() + ": is a folder; give the file of the camera path");
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in) throw CameraPathError(file.string() + ": cannot be read; check the path");
  return std::move(text).str();
}

CapturePlan planCapture(const std::shared_ptr<const scene::Scene>& scene,
                        const std::filesystem::path& file, const PictureOptions& options,
                        const Shard& shard) {
  const std::string source = file.string();
  const std::string text = readPathFile(file);
  const PathKind kind = detectPathKind(file, text);
  CameraPath path;
  CapturePlan plan;
  if (kind == PathKind::tum) path = parseTumPath(text, source, options.axes);
  if (kind == PathKind::json) path = parseJsonPath(text, source, options.axes, options.fps);
  if (kind == PathKind::script) {
    plan = planScriptFrames(scene, file, options, shard);
  } else {
    plan = kind == PathKind::gltf ? makeGltfPlan(*scene, file, options) : makePathPlan(path);
  }
  noteUnusedOptions(options, kind == PathKind::script, kind == PathKind::gltf, plan.notes);
  if (options.limit > 0 && plan.frames.size() > options.limit) plan.frames.resize(options.limit);
  if (kind != PathKind::script) assignSnapshots(scene, options.freezeScene, shard, plan.frames);
  applyLenses(plan.frames, options, path, source);
  return plan;
}

}  // namespace enfilade::server
