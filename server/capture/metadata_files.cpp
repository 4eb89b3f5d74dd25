#include "server/capture/metadata_files.hpp"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "protocol/recording/recording.hpp"
#include "render/camera/camera.hpp"
#include "scene/import/file/content_hash.hpp"
#include "server/base/camera_rotation.hpp"
#include "server/base/version.hpp"
#include "server/capture/frame_files.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;

const char* toString(DepthFile depth) {
  if (depth == DepthFile::png) return "png";
  return depth == DepthFile::zst ? "zst" : "npy";
}

Json listChannelNames(const CaptureChannels& channels) {
  Json names = Json::array();
  if (channels.rgb) names.push_back("rgb");
  if (channels.depth) names.push_back("depth");
  if (channels.ids) names.push_back("ids");
  if (channels.normals) names.push_back("normals");
  if (channels.range) names.push_back("range");
  if (channels.classes) names.push_back("class");
  if (channels.things) names.push_back("thing");
  return names;
}

std::string describeDepth(const PictureOptions& options) {
  const char* noise = options.depthNoise ? "; with the noise of a structured-light camera" : "";
  if (options.depth == DepthFile::npy)
    return std::string("float32 metres, z-distance along the camera's axis (not range); NaN: ") +
           "nothing is seen" + noise;
  std::array<char, 200> text{};
  std::snprintf(text.data(), text.size(),
                "16 bit, %g steps per metre, z-distance along the camera's axis (not range); 0: "
                "nothing is seen%s",
                options.depthStepsPerMetre,
                options.tooFar == TooFar::clamp ? "; 65535: that far or farther" : "");
  return text.data() + std::string(noise);
}

/// Rows of worldFromCamera with nerfstudio's axes: x right, y up, looks along -z.
Json makeMatrix(const render::Camera& camera) {
  const render::CameraBasis view = render::computeCameraBasis(camera);
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i)
    rows.push_back({view.right[i], view.up[i], -view.forward[i], camera.eye[i]});
  rows.push_back({0.0, 0.0, 0.0, 1.0});
  return rows;
}

void addLens(Json& into, const render::Camera& camera) {
  const render::Pinhole lens = render::computeIntrinsics(camera);
  into["fl_x"] = lens.fx;
  into["fl_y"] = lens.fy;
  into["cx"] = lens.cx;
  into["cy"] = lens.cy;
}

bool hasSameLens(const render::Camera& a, const render::Camera& b) {
  const render::Pinhole p = render::computeIntrinsics(a), q = render::computeIntrinsics(b);
  return p.fx == q.fx && p.fy == q.fy && p.cx == q.cx && p.cy == q.cy;
}

Json makeConventions(const PictureOptions& options, const scene::Model& model) {
  Json json;
  json["world"] = "right-handed, metres, Y up; file = scene + offset";
  json["offset"] = {model.offset.x(), model.offset.y(), model.offset.z()};
  json["camera"] = "x right, y up, looks along -z (OpenGL); transform_matrix is world from camera";
  json["pixels"] = "cx, cy from the top left corner; the first pixel's centre is (0.5, 0.5)";
  if (options.channels.depth) json["depth"] = describeDepth(options);
  if (options.channels.range) json["range"] = "as depth, but the distance from the eye";
  if (options.channels.ids) json["ids"] = "as in instances.json; 0: nothing is seen";
  if (options.channels.classes) json["class"] = "class_id of instances.json; 0: none";
  if (options.channels.things) json["thing"] = "thing of instances.json; 0: nothing is seen";
  if (options.channels.normals)
    json["normals"] = "float32 x, y, z, unit, world frame, towards the eye; 0, 0, 0: nothing";
  json["near"] = options.near;
  json["far"] = options.far;
  return json;
}

std::string formatTimestamp(double time) {
  std::array<char, 40> text{};
  std::snprintf(text.data(), text.size(), "%.6f", time);
  return text.data();
}

Json makeFileHash(const std::filesystem::path& file) {
  const auto hash = scene::computeFileHash(file);
  return hash ? Json(scene::toHex(*hash)) : Json(nullptr);
}

/// Key of file names in capture.json. It is informative: the next run may use other names.
constexpr const char* kNamesKey = "names";

std::string makeFileName(const std::filesystem::path& file) {
  return file.filename().string();
}

Json makeLensJson(const PictureOptions& options) {
  Json lens;
  if (options.fovY) lens["fov_radians"] = *options.fovY;
  if (const auto& p = options.pinhole) lens["intrinsics"] = {p->fx, p->fy, p->cx, p->cy};
  if (options.width && options.height) lens["size"] = {*options.width, *options.height};
  lens["near"] = options.near;
  lens["far"] = options.far;
  return lens;
}

}  // namespace

std::string makeInstancesJson(const scene::Model& model, const std::vector<AvatarName>& avatars) {
  const scene::ObjectClasses classes = scene::computeObjectClasses(model);
  Json all = Json::object();
  std::vector<std::string> bodies(model.objects.size());
  for (const scene::BodySpec& body : model.bodies)
    for (const std::uint32_t object : body.objects) bodies.at(object) = body.name;
  for (std::size_t i = 0; i < model.objects.size(); ++i) {
    const scene::Object& object = model.objects[i];
    Json one{{"path", object.path}};
    if (!object.globalId.empty()) one["global_id"] = object.globalId;
    const auto id = static_cast<std::uint32_t>(i + 1);
    if (classes.getClass(id) != 0) {
      one["class"] = classes.names[classes.getClass(id)];
      one["class_id"] = classes.getClass(id);
    }
    one["thing"] = classes.getThing(id);
    for (const scene::ObjectAttribute& attribute : object.attributes)
      one["attributes"][attribute.name] = attribute.values;
    if (object.storey) one["storey"] = model.storeys[*object.storey].name;
    if (!object.operationType.empty()) one["operation"] = object.operationType;
    if (!bodies[i].empty()) one["body"] = bodies[i];
    all[std::to_string(i + 1)] = std::move(one);
  }
  for (const AvatarName& avatar : avatars)
    all[std::to_string(avatar.id)] = Json{{"path", avatar.name},
                                          {"class", "avatar"},
                                          {"class_id", classes.getClass(avatar.id)},
                                          {"thing", avatar.id}};
  return all.dump(1) + "\n";
}

std::string makeTransformsJson(const std::vector<CaptureFrame>& captureFrames,
                               const PictureOptions& options, const scene::Model& model) {
  const render::Camera& first = captureFrames.front().camera;
  Json all;
  all["camera_model"] = "PINHOLE";
  all["w"] = first.width;
  all["h"] = first.height;
  addLens(all, first);
  for (const char* key : {"k1", "k2", "p1", "p2"}) all[key] = 0.0;
  all["enfilade"] = makeConventions(options, model);
  all["frames"] = Json::array();
  std::string text = all.dump(1);
  text.resize(text.rfind(']'));
  for (std::size_t i = 0; i < captureFrames.size(); ++i) {
    const CaptureFrame& captureFrame = captureFrames[i];
    Json frame;
    std::size_t file = 0;
    const auto files = listFrameFiles(options, i);
    const Json channels = listChannelNames(options.channels);
    for (const Json& channel : channels) {
      const std::string name = channel.get<std::string>();
      const std::string key = name == "rgb"   ? "file_path"
                              : name == "ids" ? "ids_file_path"
                                              : name + "_file_path";
      frame[key] = files[file++].generic_string();
    }
    frame["time"] = captureFrame.time;
    if (!captureFrame.name.empty()) frame["name"] = captureFrame.name;
    if (!hasSameLens(captureFrame.camera, first)) addLens(frame, captureFrame.camera);
    frame["transform_matrix"] = makeMatrix(captureFrame.camera);
    text += (i == 0 ? "\n  " : ",\n  ") + frame.dump();  // one frame per line
  }
  return text + "\n ]\n}\n";
}

std::string makeTumFileList(const std::vector<CaptureFrame>& captureFrames,
                            const PictureOptions& options, std::size_t channel,
                            const std::string& title) {
  std::string text = "# " + title + "\n# timestamp filename\n";
  for (std::size_t i = 0; i < captureFrames.size(); ++i)
    text += formatTimestamp(captureFrames[i].time) + " " +
            listFrameFiles(options, i)[channel].generic_string() + "\n";
  return text;
}

std::string makeTumGroundTruth(const std::vector<CaptureFrame>& captureFrames) {
  std::string text =
      "# ground truth; scene frame: metres, Y up; camera: x right, y down, z ahead "
      "(read it back with --axes opencv)\n# timestamp tx ty tz qx qy qz qw\n";
  for (const CaptureFrame& captureFrame : captureFrames) {
    const render::CameraBasis view = render::computeCameraBasis(captureFrame.camera);
    Mat3 rotation;
    rotation << view.right, -view.up, view.forward;
    const auto q = toQuaternion(rotation);
    const Vec3& eye = captureFrame.camera.eye;
    std::array<char, 240> line{};
    std::snprintf(line.data(), line.size(), "%s %.9g %.9g %.9g %.12g %.12g %.12g %.12g\n",
                  formatTimestamp(captureFrame.time).c_str(), eye.x(), eye.y(), eye.z(), q[0], q[1],
                  q[2], q[3]);
    text += line.data();
  }
  return text;
}

std::string makeManifest(const scene::Scene& scene, const std::filesystem::path& path,
                         const PictureOptions& options, const std::string& renderer) {
  Json all;
  all["enfilade"] = kServerVersion;
  all[kNamesKey] = {{"scene", makeFileName(scene.model().source)}, {"path", makeFileName(path)}};
  all["scene"] = protocol::toHex(scene.hash());
  all["scene_file"] = makeFileHash(scene.model().source);
  all["path"] = makeFileHash(path);
  all["renderer"] = renderer;
  all["lens"] = makeLensJson(options);
  all["axes"] = options.axes == CameraAxes::opencv ? "opencv" : "opengl";
  all["fps"] = options.fps;
  all["every"] = options.every;
  all["avatar"] = options.avatar;
  all["camera"] = options.camera;
  all["still"] = options.freezeScene;
  all["channels"] = listChannelNames(options.channels);
  all["rgb"] =
      options.rgb == RgbFile::png ? Json("png") : Json("jpeg " + std::to_string(options.quality));
  all["depth"] = toString(options.depth);
  all["depth_scale"] = options.depthStepsPerMetre;
  all["depth_noise"] = options.depthNoise ? Json(*options.depthNoise) : Json(nullptr);
  all["too_far"] = options.tooFar == TooFar::clamp ? "clamp" : "refuse";
  all["ids"] = options.ids == IdsFile::png ? "png" : "npy";
  all["layout"] = options.layout == FolderLayout::tum ? "tum" : "plain";
  const OverlayChoice& marks = options.overlay;
  all["overlay"] = Json{{"contacts", marks.contacts},
                        {"boxes", marks.boxes},
                        {"names", marks.names},
                        {"paths", marks.paths}};
  all["glass"] = options.glass == render::TransparencyMode::opaque ? "solid" : "clear";
  all["avatars"] = options.avatars == render::AvatarForm::collision ? "shapes" : "people";
  all["shadows"] = options.shadows;
  all["samples"] = options.samples;
  return all.dump(1) + "\n";
}

std::string compareManifests(const std::string& one, const std::string& other) {
  const Json a = Json::parse(one, nullptr, false), b = Json::parse(other, nullptr, false);
  if (!a.is_object() || !b.is_object()) return "one of them cannot be read";
  std::string text;
  for (const auto& [key, value] : b.items()) {
    if (key == kNamesKey || (a.contains(key) && a[key] == value)) continue;
    text += (text.empty() ? "" : "; ") + key + ": " + (a.contains(key) ? a[key].dump() : "-") +
            " there, " + value.dump() + " now";
  }
  return text;
}

}  // namespace enfilade::server
