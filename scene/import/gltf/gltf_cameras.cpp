// Steps: parse the JSON; find the node of the camera and the nodes above it; read the animation
// channels that move any of them; at each time put the nodes' translations, rotations and scales
// together from the root down (glTF 2.0, 3.5 and 3.11, appendix C for the interpolations).
#include "scene/import/gltf/gltf_cameras.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/gltf/gltf_buffers.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kNone = ~std::size_t{0};
constexpr std::size_t kDeepest = 2000;  // levels of nodes
constexpr double kMostPoses = 10'000'000;

enum class Interpolation : std::uint8_t { step, linear, cubic };

/// Keys of one property of one node; `width` numbers a value, three values a key if cubic.
struct Channel {
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;
  std::vector<double> times, values;
};

struct Node {
  std::size_t parent = kNone, camera = kNone;
  std::string name;
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  bool fromMatrix = false;
  Vec3 translation = Vec3::Zero(), scale = Vec3::Ones();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::map<std::string, Channel> channels;  ///< by path: translation, rotation, scale
};

const Json& listOf(const Json& object, const char* key) {
  static const Json none = Json::array();
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_array() ? *found : none;
}

std::size_t indexOf(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_number_unsigned() ? found->get<std::size_t>() : kNone;
}

std::string textOf(const Json& object, const char* key) {
  const auto found = object.is_object() ? object.find(key) : object.end();
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

class CameraFile {
 public:
  CameraFile(const std::filesystem::path& file, ModelFormat format)
      : file_(file),
        json_(Json::parse(gltfText(file, format), nullptr, false)),
        buffers_(file, format, json_) {
    if (!json_.is_object()) refuse("cannot be read as glTF");
    readNodes();
    readAnimations();
  }

  std::size_t choose(const std::string& name);
  GltfCameraPath sample(std::size_t camera, double fps);

 private:
  [[noreturn]] void refuse(const std::string& what) const {
    throw ImportError(file_.string() + ": " + what + " (open)");
  }
  template <std::size_t count>
  bool read(const Json& node, const char* key, std::array<double, count>& numbers) const;
  void readNodes();
  void readTransform(const Json& json, Node& node) const;
  void readAnimations();
  void readChannel(const Json& channel, const Json& samplers);
  bool moves(std::size_t node) const;
  double lastKey(std::size_t node) const;
  std::string namesOfCameras() const;
  Eigen::Affine3d fileFromNode(std::size_t node, double time) const;
  double fovOf(std::size_t camera) const;

  const std::filesystem::path& file_;
  const Json json_;
  GltfBuffers buffers_;
  std::vector<Node> nodes_;
  std::size_t overridden_ = 0;  ///< channels that move what an earlier one moves already
};

template <std::size_t count>
bool CameraFile::read(const Json& node, const char* key, std::array<double, count>& numbers) const {
  const Json& list = listOf(node, key);
  if (list.empty()) return false;
  if (list.size() != count)
    refuse(std::string(key) + " of a node has not " + std::to_string(count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) {
    if (!list[i].is_number() || !std::isfinite(list[i].get<double>()))
      refuse(std::string(key) + " of a node holds something that is no number");
    numbers[i] = list[i].get<double>();
  }
  return true;
}

void CameraFile::readTransform(const Json& json, Node& node) const {
  std::array<double, 16> m{};
  std::array<double, 3> three{};
  std::array<double, 4> q{};
  if (read(json, "matrix", m)) {
    node.fromMatrix = true;
    for (std::size_t i = 0; i < 16; ++i)
      node.matrix.matrix()(static_cast<Eigen::Index>(i % 4), static_cast<Eigen::Index>(i / 4)) =
          m[i];
    node.matrix.makeAffine();
  }
  if (read(json, "translation", three)) node.translation = Vec3(three[0], three[1], three[2]);
  if (read(json, "scale", three)) node.scale = Vec3(three[0], three[1], three[2]);
  if (read(json, "rotation", q)) node.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
}

void CameraFile::readNodes() {
  const Json& list = listOf(json_, "nodes");
  nodes_.resize(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    nodes_[i].name = textOf(list[i], "name");
    nodes_[i].camera = indexOf(list[i], "camera");
    readTransform(list[i], nodes_[i]);
    for (const Json& child : listOf(list[i], "children")) {
      if (child.is_number_unsigned() && child.get<std::size_t>() < nodes_.size())
        nodes_[child.get<std::size_t>()].parent = i;
    }
  }
}

void CameraFile::readAnimations() {
  for (const Json& animation : listOf(json_, "animations")) {
    for (const Json& channel : listOf(animation, "channels"))
      readChannel(channel, listOf(animation, "samplers"));
  }
}

void CameraFile::readChannel(const Json& json, const Json& samplers) {
  const Json target = json.is_object() ? json.value("target", Json::object()) : Json::object();
  const std::size_t node = indexOf(target, "node"), sampler = indexOf(json, "sampler");
  const std::string path = textOf(target, "path");
  if (node >= nodes_.size() || sampler >= samplers.size() || path == "weights") return;
  Channel channel;
  channel.width = path == "rotation" ? 4 : 3;
  const std::string how = textOf(samplers[sampler], "interpolation");
  if (how == "STEP") channel.interpolation = Interpolation::step;
  if (how == "CUBICSPLINE") channel.interpolation = Interpolation::cubic;
  channel.times = buffers_.numbers(indexOf(samplers[sampler], "input"), 1);
  channel.values = buffers_.numbers(indexOf(samplers[sampler], "output"), channel.width);
  const std::size_t perKey = channel.interpolation == Interpolation::cubic ? 3 : 1;
  if (channel.values.size() != channel.times.size() * channel.width * perKey)
    refuse("an animation of " + path + " has not as many values as keys");
  if (!std::is_sorted(channel.times.begin(), channel.times.end(), std::less_equal<>()))
    refuse("the keys of an animation of " + path + " do not ascend in time");
  const bool isNew = nodes_[node].channels.try_emplace(path, std::move(channel)).second;
  if (!isNew) ++overridden_;
}

// ---- values at a time ---------------------------------------------------------------------------

using Value = Eigen::Vector4d;  ///< of three numbers the last is 0

Value valueAt(const Channel& channel, std::size_t index) {
  Value value = Value::Zero();
  for (std::size_t k = 0; k < channel.width; ++k)
    value[static_cast<Eigen::Index>(k)] = channel.values[index * channel.width + k];
  return value;
}

/// The shorter way round, as the specification has it.
Value slerped(const Value& from, const Value& to, double part) {
  const Eigen::Quaterniond a(from), b(to);
  return a.normalized().slerp(part, b.normalized()).coeffs();
}

/// glTF 2.0, appendix C.5: Hermite's cubic; tangents are per second.
Value cubic(const Channel& channel, std::size_t key, double part, double seconds) {
  const double t2 = part * part, t3 = t2 * part;
  return (2 * t3 - 3 * t2 + 1) * valueAt(channel, 3 * key + 1) +
         seconds * (t3 - 2 * t2 + part) * valueAt(channel, 3 * key + 2) +
         (3 * t2 - 2 * t3) * valueAt(channel, 3 * key + 4) +
         seconds * (t3 - t2) * valueAt(channel, 3 * key + 3);
}

Value sampled(const Channel& channel, double time) {
  const bool isCubic = channel.interpolation == Interpolation::cubic;
  const auto held = [&](std::size_t key) { return valueAt(channel, isCubic ? 3 * key + 1 : key); };
  const auto after = std::upper_bound(channel.times.begin(), channel.times.end(), time);
  if (after == channel.times.begin()) return held(0);
  const auto key = static_cast<std::size_t>(after - channel.times.begin()) - 1;
  if (after == channel.times.end() || channel.interpolation == Interpolation::step)
    return held(key);
  const double seconds = *after - channel.times[key];
  const double part = (time - channel.times[key]) / seconds;
  if (isCubic) return cubic(channel, key, part, seconds);
  if (channel.width == 4) return slerped(held(key), held(key + 1), part);
  return (1 - part) * held(key) + part * held(key + 1);
}

Eigen::Affine3d parentFromNode(const Node& node, double time) {
  if (node.fromMatrix && node.channels.empty()) return node.matrix;
  const auto animated = [&](const char* path) {
    const auto found = node.channels.find(path);
    return found == node.channels.end() ? nullptr : &found->second;
  };
  const Channel* moved = animated("translation");
  const Channel* turned = animated("rotation");
  const Channel* scaled = animated("scale");
  const Vec3 translation = moved ? Vec3(sampled(*moved, time).head<3>()) : node.translation;
  const Vec3 scale = scaled ? Vec3(sampled(*scaled, time).head<3>()) : node.scale;
  const Eigen::Quaterniond rotation =
      turned ? Eigen::Quaterniond(sampled(*turned, time)) : node.rotation;
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.translate(translation);
  result.rotate(rotation.normalized());
  result.scale(scale);
  return result;
}

// ---- the camera ---------------------------------------------------------------------------------

bool CameraFile::moves(std::size_t node) const {
  for (std::size_t level = 0; node != kNone && level < kDeepest; ++level) {
    if (!nodes_[node].channels.empty()) return true;
    node = nodes_[node].parent;
  }
  return false;
}

double CameraFile::lastKey(std::size_t node) const {
  double last = 0;
  for (std::size_t level = 0; node != kNone && level < kDeepest; ++level) {
    for (const auto& [path, channel] : nodes_[node].channels)
      last = std::max(last, channel.times.back());
    node = nodes_[node].parent;
  }
  return last;
}

std::string CameraFile::namesOfCameras() const {
  std::string names;
  for (const Node& node : nodes_)
    if (node.camera != kNone) names += (names.empty() ? "" : ", ") + node.name;
  return names;
}

std::size_t CameraFile::choose(const std::string& name) {
  const Json& cameras = listOf(json_, "cameras");
  const auto called = [&](const Node& node) {
    return node.name == name ||
           (node.camera < cameras.size() && textOf(cameras[node.camera], "name") == name);
  };
  std::size_t first = kNone;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].camera == kNone || (!name.empty() && !called(nodes_[i]))) continue;
    if (!name.empty() || moves(i)) return i;
    if (first == kNone) first = i;
  }
  if (first != kNone) return first;
  const std::string there = namesOfCameras();
  if (there.empty()) refuse("holds no camera; add one, or give a path of another kind");
  refuse("holds no camera called " + name + "; there are: " + there);
}

Eigen::Affine3d CameraFile::fileFromNode(std::size_t node, double time) const {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  for (std::size_t level = 0; node != kNone; ++level) {
    if (level == kDeepest) refuse("its nodes are nested more than 2000 deep, or in a ring");
    result = parentFromNode(nodes_[node], time) * result;
    node = nodes_[node].parent;
  }
  return result;
}

double CameraFile::fovOf(std::size_t camera) const {
  const Json& cameras = listOf(json_, "cameras");
  const Json none = Json::object();
  const Json& json =
      camera < cameras.size() && cameras[camera].is_object() ? cameras[camera] : none;
  if (textOf(json, "type") != "perspective" || !json.contains("perspective"))
    refuse("its camera is no perspective; pictures along a path are");
  const Json fov =
      json["perspective"].is_object() ? json["perspective"].value("yfov", Json()) : Json();
  if (!fov.is_number() || !(fov.get<double>() > 0 && fov.get<double>() < 3.14159))
    refuse("its camera's yfov must lie between 0 and pi");
  return fov.get<double>();
}

GltfCameraPath CameraFile::sample(std::size_t camera, double fps) {
  GltfCameraPath path;
  path.name = nodes_[camera].name;
  path.fovY = fovOf(nodes_[camera].camera);
  if (overridden_ > 0)
    path.notes.push_back(std::to_string(overridden_) +
                         " animation channels move what an earlier one moves: left out");
  const double frames = std::floor(lastKey(camera) * fps + 1e-6) + 1;
  if (!(frames <= kMostPoses))
    refuse("its animation makes more than 10,000,000 frames; lower --fps");
  for (std::size_t k = 0; k < static_cast<std::size_t>(frames); ++k) {
    const double time = static_cast<double>(k) / fps;
    const Eigen::Affine3d placed = fileFromNode(camera, time);
    const Vec3 back = placed.linear().col(2), up = placed.linear().col(1);
    if (!placed.matrix().allFinite() || !(back.cross(up).norm() > 1e-12))
      refuse("its camera is scaled to nothing at " + std::to_string(time) + " s");
    GltfCameraPose pose{time, placed.translation(), -back.normalized(), up};
    pose.up = (up - up.dot(pose.forward) * pose.forward).normalized();
    path.poses.push_back(pose);
  }
  return path;
}

}  // namespace

GltfCameraPath sampleGltfCamera(const std::filesystem::path& file, const std::string& name,
                                double fps) {
  const auto format = modelFormatOf(file);
  if (format != ModelFormat::gltf && format != ModelFormat::glb)
    throw ImportError(file.string() + ": is neither .gltf nor .glb (open)");
  CameraFile cameras(file, *format);
  return cameras.sample(cameras.choose(name), fps);
}

Eigen::Affine3d sceneFromFile(const Model& model) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() = yUpFrom(model.up) * model.metresPerUnit;
  result.translation() = -model.offset;
  return result;
}

}  // namespace enfilade::scene
