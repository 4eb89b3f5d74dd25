#include "server/capture/metadata_files.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "render/camera_basis.hpp"
#include "scene/import/worker/content_hash.hpp"
#include "server/base/version.hpp"
#include "server/capture/frame_files.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;

const char* textOf(DepthFile depth) {
  if (depth == DepthFile::png) return "png";
  return depth == DepthFile::zst ? "zst" : "npy";
}

Json channelNames(const CaptureChannels& channels) {
  Json names = Json::array();
  if (channels.rgb) names.push_back("rgb");
  if (channels.depth) names.push_back("depth");
  if (channels.ids) names.push_back("ids");
  if (channels.normals) names.push_back("normals");
  if (channels.range) names.push_back("range");
  return names;
}

std::string depthWords(const PictureOptions& options) {
  if (options.depth == DepthFile::npy)
    return "float32 metres, z-distance along the camera's axis (not range); NaN: nothing is seen";
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "16 bit, %g steps a metre, z-distance along the camera's axis (not range); 0: "
                "nothing is seen%s",
                options.depthSteps,
                options.tooFar == TooFar::clamp ? "; 65535: that far or farther" : "");
  return text.data();
}

/// Rows of worldFromCamera with the axes that nerfstudio has: x right, y up, looks along -z.
Json matrixOf(const render::Camera& camera) {
  const render::View view = render::viewOf(camera);
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i)
    rows.push_back({view.right[i], view.up[i], -view.forward[i], camera.eye[i]});
  rows.push_back({0.0, 0.0, 0.0, 1.0});
  return rows;
}

void addLens(Json& into, const render::Camera& camera) {
  const render::Pinhole lens = render::intrinsicsOf(camera);
  into["fl_x"] = lens.fx;
  into["fl_y"] = lens.fy;
  into["cx"] = lens.cx;
  into["cy"] = lens.cy;
}

bool sameLens(const render::Camera& a, const render::Camera& b) {
  const render::Pinhole p = render::intrinsicsOf(a), q = render::intrinsicsOf(b);
  return p.fx == q.fx && p.fy == q.fy && p.cx == q.cx && p.cy == q.cy;
}

Json conventions(const PictureOptions& options, const scene::Model& model) {
  Json told;
  told["world"] = "right-handed, metres, Y up; file = scene + offset";
  told["offset"] = {model.offset.x(), model.offset.y(), model.offset.z()};
  told["camera"] = "x right, y up, looks along -z (OpenGL); transform_matrix is world from camera";
  told["pixels"] = "cx, cy from the top left corner; the first pixel's centre is (0.5, 0.5)";
  if (options.channels.depth) told["depth"] = depthWords(options);
  if (options.channels.range) told["range"] = "as depth, but the distance from the eye";
  if (options.channels.ids) told["ids"] = "as in instances.json; 0: nothing is seen";
  if (options.channels.normals)
    told["normals"] = "float32 x, y, z, unit, world frame, towards the eye; 0, 0, 0: nothing";
  told["near"] = options.near;
  told["far"] = options.far;
  return told;
}

std::string stamp(double time) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.6f", time);
  return text.data();
}

Json hashOf(const std::filesystem::path& file) {
  const auto hash = scene::contentHashOfFile(file);
  return hash ? Json(scene::hexOf(*hash)) : Json(nullptr);
}

/// Of capture.json, for people: the same files may be called otherwise the next time.
constexpr const char* kNames = "names";

std::string fileName(const std::filesystem::path& file) {
  return file.filename().string();
}

Json lensOptions(const PictureOptions& options) {
  Json lens;
  if (options.fovY) lens["fov_radians"] = *options.fovY;
  if (const auto& p = options.pinhole) lens["intrinsics"] = {p->fx, p->fy, p->cx, p->cy};
  if (options.width && options.height) lens["size"] = {*options.width, *options.height};
  lens["near"] = options.near;
  lens["far"] = options.far;
  return lens;
}

}  // namespace

std::string instancesJson(const scene::Model& model, const std::vector<WalkerName>& walkers) {
  Json all = Json::object();
  std::vector<std::string> bodies(model.objects.size());
  for (const scene::BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) bodies.at(object) = body.name;
  for (std::size_t i = 0; i < model.objects.size(); ++i) {
    const scene::Object& object = model.objects[i];
    Json one{{"path", object.path}};
    if (!object.globalId.empty()) one["global_id"] = object.globalId;
    if (!object.ifcClass.empty()) one["class"] = object.ifcClass;
    if (!object.operation.empty()) one["operation"] = object.operation;
    if (!bodies[i].empty()) one["body"] = bodies[i];
    all[std::to_string(i + 1)] = std::move(one);
  }
  for (const WalkerName& walker : walkers)
    all[std::to_string(walker.id)] = Json{{"path", walker.name}, {"class", "avatar"}};
  return all.dump(1) + "\n";
}

std::string transformsJson(const std::vector<Shot>& shots, const PictureOptions& options,
                           const scene::Model& model) {
  const render::Camera& first = shots.front().camera;
  Json all;
  all["camera_model"] = "PINHOLE";
  all["w"] = first.width;
  all["h"] = first.height;
  addLens(all, first);
  for (const char* key : {"k1", "k2", "p1", "p2"}) all[key] = 0.0;
  all["enfilade"] = conventions(options, model);
  all["frames"] = Json::array();
  std::string text = all.dump(1);
  text.resize(text.rfind(']'));
  for (std::size_t i = 0; i < shots.size(); ++i) {
    const Shot& shot = shots[i];
    Json frame;
    std::size_t file = 0;
    const auto files = filesOfFrame(options, i);
    const Json channels = channelNames(options.channels);
    for (const Json& channel : channels) {
      const std::string name = channel.get<std::string>();
      const std::string key = name == "rgb"   ? "file_path"
                              : name == "ids" ? "ids_file_path"
                                              : name + "_file_path";
      frame[key] = files[file++].generic_string();
    }
    frame["time"] = shot.time;
    if (!shot.name.empty()) frame["name"] = shot.name;
    if (!sameLens(shot.camera, first)) addLens(frame, shot.camera);
    frame["transform_matrix"] = matrixOf(shot.camera);
    text += (i == 0 ? "\n  " : ",\n  ") + frame.dump();  // a frame a line
  }
  return text + "\n ]\n}\n";
}

std::string tumFileList(const std::vector<Shot>& shots, const PictureOptions& options,
                        std::size_t channel, const std::string& what) {
  std::string text = "# " + what + "\n# timestamp filename\n";
  for (std::size_t i = 0; i < shots.size(); ++i)
    text += stamp(shots[i].time) + " " + filesOfFrame(options, i)[channel].generic_string() + "\n";
  return text;
}

std::string tumGroundTruth(const std::vector<Shot>& shots) {
  std::string text =
      "# ground truth; scene frame: metres, Y up; camera: x right, y down, z ahead "
      "(read it back with --axes opencv)\n# timestamp tx ty tz qx qy qz qw\n";
  for (const Shot& shot : shots) {
    const render::View view = render::viewOf(shot.camera);
    Mat3 turned;
    turned << view.right, -view.up, view.forward;
    const auto q = quaternionOf(turned);
    const Vec3& eye = shot.camera.eye;
    std::array<char, 240> line{};
    std::snprintf(line.data(), line.size(), "%s %.9g %.9g %.9g %.12g %.12g %.12g %.12g\n",
                  stamp(shot.time).c_str(), eye.x(), eye.y(), eye.z(), q[0], q[1], q[2], q[3]);
    text += line.data();
  }
  return text;
}

std::string manifestJson(const scene::Scene& scene, const std::filesystem::path& path,
                         const PictureOptions& options, const std::string& renderer) {
  Json all;
  std::array<char, 24> hash{};
  std::snprintf(hash.data(), hash.size(), "%016llx", static_cast<unsigned long long>(scene.hash()));
  all["enfilade"] = kServerVersion;
  all[kNames] = {{"scene", fileName(scene.model().source)}, {"path", fileName(path)}};
  all["scene"] = hash.data();
  all["scene_file"] = hashOf(scene.model().source);
  all["path"] = hashOf(path);
  all["renderer"] = renderer;
  all["lens"] = lensOptions(options);
  all["axes"] = options.axes == CameraAxes::opencv ? "opencv" : "opengl";
  all["fps"] = options.fps;
  all["every"] = options.every;
  all["avatar"] = options.avatar;
  all["camera"] = options.camera;
  all["still"] = options.still;
  all["channels"] = channelNames(options.channels);
  all["rgb"] =
      options.rgb == RgbFile::png ? Json("png") : Json("jpeg " + std::to_string(options.quality));
  all["depth"] = textOf(options.depth);
  all["depth_scale"] = options.depthSteps;
  all["too_far"] = options.tooFar == TooFar::clamp ? "clamp" : "refuse";
  all["ids"] = options.ids == IdsFile::png ? "png" : "npy";
  all["layout"] = options.layout == FolderLayout::tum ? "tum" : "plain";
  const OverlayChoice& marks = options.overlay;
  all["overlay"] = Json{{"contacts", marks.contacts},
                        {"boxes", marks.boxes},
                        {"names", marks.names},
                        {"paths", marks.paths}};
  all["glass"] = options.glass == render::Glass::solid ? "solid" : "clear";
  all["shadows"] = options.shadows;
  return all.dump(1) + "\n";
}

std::string manifestDifference(const std::string& one, const std::string& other) {
  const Json a = Json::parse(one, nullptr, false), b = Json::parse(other, nullptr, false);
  if (!a.is_object() || !b.is_object()) return "one of the two cannot be read";
  std::string text;
  for (const auto& [key, value] : b.items()) {
    if (key == kNames || (a.contains(key) && a[key] == value)) continue;
    text += (text.empty() ? "" : "; ") + key + ": " + (a.contains(key) ? a[key].dump() : "-") +
            " there, " + value.dump() + " now";
  }
  return text;
}

}  // namespace enfilade::server
