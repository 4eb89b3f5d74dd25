// Steps: parse the JSON; find the camera's node and its ancestors; read the animation channels that
// move any of them. For each time, multiply the interpolated node transforms from the root down
// (glTF 2.0, 3.5 and 3.11; appendix C for the interpolations).
#include "scene/import/gltf/gltf_cameras.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/gltf_buffers.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr double kMaxPoses = 10'000'000;

enum class Interpolation : std::uint8_t { step, linear, cubic };

/// Keys of one property of one node: `width` numbers per value, three values per key if cubic.
struct Channel {
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 3;
  std::vector<double> times, values;
};

struct Node {
  std::size_t parent = kNoIndex, camera = kNoIndex;
  std::string name;
  Eigen::Affine3d matrix = Eigen::Affine3d::Identity();
  bool fromMatrix = false;
  Vec3 translation = Vec3::Zero(), scale = Vec3::Ones();
  Eigen::Quaterniond rotation = Eigen::Quaterniond::Identity();
  std::map<std::string, Channel> channels;  ///< by path: translation, rotation, scale
};

std::size_t getIndex(const Json& object, const char* key) {
  return readIndexMember(&object, key).value_or(kNoIndex);
}

std::string getString(const Json& object, const char* key) {
  const Json* text = findMember(&object, key);
  return text != nullptr && text->is_string() ? text->get<std::string>() : std::string();
}

class GltfCameraReader {
 public:
  GltfCameraReader(const std::filesystem::path& file, ModelFormat format)
      : file_(file),
        json_(Json::parse(readGltfJson(file, format), nullptr, false)),
        buffers_(file, format, json_) {
    if (!json_.is_object()) fail("is not valid glTF");
    readNodes();
    readAnimations();
  }

  std::size_t chooseCamera(const std::string& name);
  GltfCameraPath samplePath(std::size_t camera, double fps);

 private:
  [[noreturn]] void fail(const std::string& message) const {
    throw ImportError(file_.string() + ": " + message);
  }
  template <std::size_t count>
  bool readArray(const Json& node, const char* key, std::array<double, count>& numbers) const;
  void readNodes();
  void readTransform(const Json& json, Node& node) const;
  void readAnimations();
  void readChannel(const Json& channel, const Json& samplers);
  bool isAnimated(std::size_t node) const;
  double findLastKeyTime(std::size_t node) const;
  std::string listCameraNames() const;
  Eigen::Affine3d computeFileFromNode(std::size_t node, double time) const;
  double readFovY(std::size_t camera) const;

  const std::filesystem::path& file_;
  const Json json_;
  GltfBuffers buffers_;
  std::vector<Node> nodes_;
  std::size_t overriddenChannels_ = 0;  ///< ignored channels: an earlier one has the same target
};

template <std::size_t count>
bool GltfCameraReader::readArray(const Json& node, const char* key,
                                 std::array<double, count>& numbers) const {
  const Json& list = getArray(node, key);
  if (list.empty()) return false;
  if (list.size() != count)
    fail(std::string(key) + " of a node does not have " + std::to_string(count) + " numbers");
  for (std::size_t i = 0; i < count; ++i) {
    if (!list[i].is_number() || !std::isfinite(list[i].get<double>()))
      fail(std::string(key) + " of a node contains a value that is not a number");
    numbers[i] = list[i].get<double>();
  }
  return true;
}

void GltfCameraReader::readTransform(const Json& json, Node& node) const {
  std::array<double, 16> m{};
  std::array<double, 3> three{};
  std::array<double, 4> q{};
  if (readArray(json, "matrix", m)) {
    node.fromMatrix = true;
    for (std::size_t i = 0; i < 16; ++i)
      node.matrix.matrix()(static_cast<Eigen::Index>(i % 4), static_cast<Eigen::Index>(i / 4)) =
          m[i];
    node.matrix.makeAffine();
  }
  if (readArray(json, "translation", three)) node.translation = Vec3(three[0], three[1], three[2]);
  if (readArray(json, "scale", three)) node.scale = Vec3(three[0], three[1], three[2]);
  if (readArray(json, "rotation", q)) node.rotation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
}

void GltfCameraReader::readNodes() {
  const Json& list = getArray(json_, "nodes");
  nodes_.resize(list.size());
  for (std::size_t i = 0; i < list.size(); ++i) {
    nodes_[i].name = getString(list[i], "name");
    nodes_[i].camera = getIndex(list[i], "camera");
    readTransform(list[i], nodes_[i]);
    for (const Json& child : getArray(list[i], "children")) {
      if (child.is_number_unsigned() && child.get<std::size_t>() < nodes_.size())
        nodes_[child.get<std::size_t>()].parent = i;
    }
  }
}

void GltfCameraReader::readAnimations() {
  for (const Json& animation : getArray(json_, "animations")) {
    for (const Json& channel : getArray(animation, "channels"))
      readChannel(channel, getArray(animation, "samplers"));
  }
}

void GltfCameraReader::readChannel(const Json& json, const Json& samplers) {
  const Json target = json.is_object() ? json.value("target", Json::object()) : Json::object();
  const std::size_t node = getIndex(target, "node"), sampler = getIndex(json, "sampler");
  const std::string path = getString(target, "path");
  if (node >= nodes_.size() || sampler >= samplers.size() || path == "weights") return;
  Channel channel;
  channel.width = path == "rotation" ? 4 : 3;
  const std::string mode = getString(samplers[sampler], "interpolation");
  if (mode == "STEP") channel.interpolation = Interpolation::step;
  if (mode == "CUBICSPLINE") channel.interpolation = Interpolation::cubic;
  channel.times = buffers_.readNumbers(getIndex(samplers[sampler], "input"), 1);
  channel.values = buffers_.readNumbers(getIndex(samplers[sampler], "output"), channel.width);
  const std::size_t perKey = channel.interpolation == Interpolation::cubic ? 3 : 1;
  if (channel.values.size() != channel.times.size() * channel.width * perKey)
    fail("an animation of " + path + " has different numbers of values and keys");
  if (!std::is_sorted(channel.times.begin(), channel.times.end(), std::less_equal<>()))
    fail("the key times of an animation of " + path + " do not ascend");
  const bool isNew = nodes_[node].channels.try_emplace(path, std::move(channel)).second;
  if (!isNew) ++overriddenChannels_;
}

// ---- values at a time ---------------------------------------------------------------------------

using Value = Eigen::Vector4d;  ///< of three-component values the last is 0

Value getKeyValue(const Channel& channel, std::size_t index) {
  Value value = Value::Zero();
  for (std::size_t k = 0; k < channel.width; ++k)
    value[static_cast<Eigen::Index>(k)] = channel.values[index * channel.width + k];
  return value;
}

/// Spherical linear interpolation along the shorter arc, as the specification requires.
Value interpolateRotation(const Value& from, const Value& to, double fraction) {
  const Eigen::Quaterniond a(from), b(to);
  return a.normalized().slerp(fraction, b.normalized()).coeffs();
}

/// Cubic Hermite spline (glTF 2.0, appendix C.5); tangents are per second.
Value interpolateCubic(const Channel& channel, std::size_t key, double fraction, double seconds) {
  const double t2 = fraction * fraction, t3 = t2 * fraction;
  return (2 * t3 - 3 * t2 + 1) * getKeyValue(channel, 3 * key + 1) +
         seconds * (t3 - 2 * t2 + fraction) * getKeyValue(channel, 3 * key + 2) +
         (3 * t2 - 2 * t3) * getKeyValue(channel, 3 * key + 4) +
         seconds * (t3 - t2) * getKeyValue(channel, 3 * key + 3);
}

Value sampleChannel(const Channel& channel, double time) {
  const bool isCubic = channel.interpolation == Interpolation::cubic;
  const auto keyValue = [&](std::size_t key) {
    return getKeyValue(channel, isCubic ? 3 * key + 1 : key);
  };
  const auto after = std::upper_bound(channel.times.begin(), channel.times.end(), time);
  if (after == channel.times.begin()) return keyValue(0);
  const auto key = static_cast<std::size_t>(after - channel.times.begin()) - 1;
  if (after == channel.times.end() || channel.interpolation == Interpolation::step)
    return keyValue(key);
  const double seconds = *after - channel.times[key];
  const double fraction = (time - channel.times[key]) / seconds;
  if (isCubic) return interpolateCubic(channel, key, fraction, seconds);
  if (channel.width == 4) return interpolateRotation(keyValue(key), keyValue(key + 1), fraction);
  return (1 - fraction) * keyValue(key) + fraction * keyValue(key + 1);
}

Eigen::Affine3d computeParentFromNode(const Node& node, double time) {
  if (node.fromMatrix && node.channels.empty()) return node.matrix;
  const auto animated = [&](const char* path) {
    const auto found = node.channels.find(path);
    return found == node.channels.end() ? nullptr : &found->second;
  };
  const Channel* translationChannel = animated("translation");
  const Channel* rotationChannel = animated("rotation");
  const Channel* scaleChannel = animated("scale");
  const Vec3 translation = translationChannel
                               ? Vec3(sampleChannel(*translationChannel, time).head<3>())
                               : node.translation;
  const Vec3 scale = scaleChannel ? Vec3(sampleChannel(*scaleChannel, time).head<3>()) : node.scale;
  const Eigen::Quaterniond rotation =
      rotationChannel ? Eigen::Quaterniond(sampleChannel(*rotationChannel, time)) : node.rotation;
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.translate(translation);
  result.rotate(rotation.normalized());
  result.scale(scale);
  return result;
}

// ---- the camera ---------------------------------------------------------------------------------

bool GltfCameraReader::isAnimated(std::size_t node) const {
  for (int level = 0; node != kNoIndex && level < kMaxNodeDepth; ++level) {
    if (!nodes_[node].channels.empty()) return true;
    node = nodes_[node].parent;
  }
  return false;
}

double GltfCameraReader::findLastKeyTime(std::size_t node) const {
  double last = 0;
  for (int level = 0; node != kNoIndex && level < kMaxNodeDepth; ++level) {
    for (const auto& [path, channel] : nodes_[node].channels)
      last = std::max(last, channel.times.back());
    node = nodes_[node].parent;
  }
  return last;
}

std::string GltfCameraReader::listCameraNames() const {
  std::string names;
  for (const Node& node : nodes_)
    if (node.camera != kNoIndex) names += (names.empty() ? "" : ", ") + node.name;
  return names;
}

std::size_t GltfCameraReader::chooseCamera(const std::string& name) {
  const Json& cameras = getArray(json_, "cameras");
  const auto matchesName = [&](const Node& node) {
    return node.name == name ||
           (node.camera < cameras.size() && getString(cameras[node.camera], "name") == name);
  };
  std::size_t first = kNoIndex;
  for (std::size_t i = 0; i < nodes_.size(); ++i) {
    if (nodes_[i].camera == kNoIndex || (!name.empty() && !matchesName(nodes_[i]))) continue;
    if (!name.empty() || isAnimated(i)) return i;
    if (first == kNoIndex) first = i;
  }
  if (first != kNoIndex) return first;
  const std::string available = listCameraNames();
  if (available.empty()) fail("contains no camera; add one, or use another kind of path");
  fail("contains no camera named '" + name + "'; its cameras: " + available);
}

Eigen::Affine3d GltfCameraReader::computeFileFromNode(std::size_t node, double time) const {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  for (int level = 0; node != kNoIndex; ++level) {
    if (level == kMaxNodeDepth)
      fail("its nodes are nested more than 2000 levels deep, or in a cycle");
    result = computeParentFromNode(nodes_[node], time) * result;
    node = nodes_[node].parent;
  }
  return result;
}

double GltfCameraReader::readFovY(std::size_t camera) const {
  const Json& cameras = getArray(json_, "cameras");
  const Json none = Json::object();
  const Json& json =
      camera < cameras.size() && cameras[camera].is_object() ? cameras[camera] : none;
  if (getString(json, "type") != "perspective" || !json.contains("perspective"))
    fail("its camera is not perspective; camera paths require a perspective camera");
  const Json fov =
      json["perspective"].is_object() ? json["perspective"].value("yfov", Json()) : Json();
  if (!fov.is_number() || !(fov.get<double>() > 0 && fov.get<double>() < 3.14159))
    fail("its camera's yfov must be between 0 and pi");
  return fov.get<double>();
}

GltfCameraPath GltfCameraReader::samplePath(std::size_t camera, double fps) {
  GltfCameraPath path;
  path.name = nodes_[camera].name;
  path.fovY = readFovY(nodes_[camera].camera);
  if (overriddenChannels_ > 0)
    path.notes.push_back(std::to_string(overriddenChannels_) +
                         " animation channels have the target of an earlier channel: ignored");
  const double frames = std::floor(findLastKeyTime(camera) * fps + 1e-6) + 1;
  if (!(frames <= kMaxPoses))
    fail("its animation would produce more than 10,000,000 frames; lower --fps");
  for (std::size_t k = 0; k < static_cast<std::size_t>(frames); ++k) {
    const double time = static_cast<double>(k) / fps;
    const Eigen::Affine3d fileFromCamera = computeFileFromNode(camera, time);
    const Vec3 back = fileFromCamera.linear().col(2), up = fileFromCamera.linear().col(1);
    if (!fileFromCamera.matrix().allFinite() || !(back.cross(up).norm() > 1e-12))
      fail("its camera is scaled to zero at " + std::to_string(time) + " s");
    GltfCameraPose pose{time, fileFromCamera.translation(), -back.normalized(), up};
    pose.up = (up - up.dot(pose.forward) * pose.forward).normalized();
    path.poses.push_back(pose);
  }
  return path;
}

}  // namespace

GltfCameraPath sampleGltfCamera(const std::filesystem::path& file, const std::string& name,
                                double fps) {
  const auto format = detectModelFormat(file);
  if (format != ModelFormat::gltf && format != ModelFormat::glb)
    throw ImportError(file.string() + ": is neither .gltf nor .glb");
  GltfCameraReader cameras(file, *format);
  return cameras.samplePath(cameras.chooseCamera(name), fps);
}

Eigen::Affine3d computeSceneFromFile(const Model& model) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() = makeYUpRotation(model.upAxis) * model.metresPerUnit;
  result.translation() = -model.offset;
  return result;
}

}  // namespace enfilade::scene
