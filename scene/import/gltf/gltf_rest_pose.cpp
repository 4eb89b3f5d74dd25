#include "scene/import/gltf/gltf_rest_pose.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "scene/import/gltf/encoding/draco_mesh.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/encoding/gltf_nodes.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/box_mesh.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;
using Eigen::Affine3d;

constexpr std::size_t kJointsOfSet = 4;

/// The parents of all nodes, and their world transforms on demand.
class NodeHierarchy {
 public:
  explicit NodeHierarchy(const Json& nodes) : nodes_(nodes), parents_(nodes.size(), kNoIndex) {
    for (std::size_t node = 0; node < nodes.size(); ++node) {
      for (const Json& child : getArray(nodes[node], "children"))
        if (child.is_number_unsigned() && child.get<std::size_t>() < nodes.size())
          parents_[child.get<std::size_t>()] = node;
    }
  }

  Affine3d worldFromNode(std::size_t node) const {
    Affine3d transform = Affine3d::Identity();
    for (int depth = 0; node != kNoIndex && depth < kMaxNodeDepth; ++depth) {
      if (nodes_[node].is_object())
        transform = readNodeTransform(nodes_[node]).parentFromNode * transform;
      node = parents_[node];
    }
    return transform;
  }
  std::size_t size() const { return nodes_.size(); }

 private:
  const Json& nodes_;
  std::vector<std::size_t> parents_;
};

std::vector<Affine3d> readInverseBinds(const Json& skin, std::size_t joints, GltfBuffers& buffers,
                                       const std::string& name) {
  std::vector<Affine3d> matrices(joints, Affine3d::Identity());
  const auto accessor = readIndexMember(&skin, "inverseBindMatrices");
  if (!accessor) return matrices;  // the standard's default: identities
  const std::vector<double> numbers = buffers.readNumbers(*accessor, 16);
  if (numbers.size() < 16 * joints)
    buffers.fail(name + ": has fewer inverse bind matrices than joints");
  for (std::size_t joint = 0; joint < joints; ++joint) {
    for (int i = 0; i < 16; ++i)
      matrices[joint].matrix()(i % 4, i / 4) = numbers[16 * joint + static_cast<std::size_t>(i)];
    matrices[joint].makeAffine();
  }
  return matrices;
}

/// The node's own transform does not move a skinned mesh: it is undone here, as it is applied
/// later.
std::vector<Affine3d> placeJoints(const Json& skin, const Affine3d& nodeFromWorld,
                                  const NodeHierarchy& hierarchy, GltfBuffers& buffers,
                                  const std::string& name) {
  const Json& joints = getArray(skin, "joints");
  if (joints.empty()) buffers.fail(name + ": has no joints");
  std::vector<Affine3d> placed = readInverseBinds(skin, joints.size(), buffers, name);
  for (std::size_t joint = 0; joint < joints.size(); ++joint) {
    if (!joints[joint].is_number_unsigned() || joints[joint].get<std::size_t>() >= hierarchy.size())
      buffers.fail(name + ": joint " + std::to_string(joint) + " is not a node");
    placed[joint] =
        nodeFromWorld * hierarchy.worldFromNode(joints[joint].get<std::size_t>()) * placed[joint];
    if (!placed[joint].matrix().allFinite())
      buffers.fail(name + ": the place of joint " + std::to_string(joint) + " is not finite");
  }
  return placed;
}

/// The weights of the node, otherwise of its mesh; empty if all are 0.
std::vector<double> readMorphWeights(const Json& node, const Json& mesh) {
  const Json& own = getArray(node, "weights");
  std::vector<double> weights;
  for (const Json& weight : own.empty() ? getArray(mesh, "weights") : own)
    weights.push_back(weight.is_number() ? weight.get<double>() : 0);
  const bool isNeutral = std::ranges::all_of(weights, [](double weight) { return weight == 0; });
  return isNeutral ? std::vector<double>{} : weights;
}

Eigen::Vector3d getVector(const std::vector<float>& values, std::size_t vertex) {
  return Eigen::Map<const Eigen::Vector3f>(values.data() + 3 * vertex).cast<double>();
}

void setVector(std::vector<float>& values, std::size_t vertex, const Eigen::Vector3d& to) {
  for (int axis = 0; axis < 3; ++axis)
    values[3 * vertex + static_cast<std::size_t>(axis)] = static_cast<float>(to[axis]);
}

/// Transforms a normal: with the matrix of cofactors, which is right for any scale, mirrors too.
Eigen::Vector3d transformNormal(const Eigen::Matrix3d& linear, const Eigen::Vector3d& normal) {
  Eigen::Matrix3d cofactors;
  cofactors << linear.col(1).cross(linear.col(2)), linear.col(2).cross(linear.col(0)),
      linear.col(0).cross(linear.col(1));
  const Eigen::Vector3d turned = cofactors * normal;
  return turned.norm() > 0 ? Eigen::Vector3d(turned.normalized()) : normal;
}

using WeightVisitor = std::function<void(std::size_t vertex, std::size_t joint, double weight)>;

/// Calls `visit` with each weight that is not 0. Throws ImportError.
void visitWeights(const RestPose& pose, std::size_t vertices, GltfBuffers& buffers,
                  const std::string& name, const PrimitiveArrays& arrays,
                  const WeightVisitor& visit) {
  for (int set = 0; arrays.contains("JOINTS_" + std::to_string(set)); ++set) {
    const std::vector<float>& joints = arrays.at("JOINTS_" + std::to_string(set));
    const auto weights = arrays.find("WEIGHTS_" + std::to_string(set));
    if (joints.size() != kJointsOfSet * vertices || weights == arrays.end() ||
        weights->second.size() != joints.size())
      buffers.fail(name + ": its joints and weights do not fit its vertices");
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const double weight = static_cast<double>(weights->second[i]);
      if (weight == 0) continue;
      if (!(joints[i] >= 0) || joints[i] >= static_cast<float>(pose.nodeFromJoint.size()))
        buffers.fail(name + ": joint " + std::to_string(joints[i]) + " is not in its skin");
      visit(i / kJointsOfSet, static_cast<std::size_t>(joints[i]), weight);
    }
  }
}

/// The arrays JOINTS_n and WEIGHTS_n of a primitive. Throws ImportError.
PrimitiveArrays readInfluences(const Json& primitive, GltfBuffers& buffers,
                               const std::string& name) {
  const Json* draco = findMember(findMember(&primitive, "extensions"), kDracoExtension);
  if (findMember(findMember(draco, "attributes"), "JOINTS_0") != nullptr)
    buffers.fail(name + ": its joints are in its Draco data");
  const Json* attributes = findMember(&primitive, "attributes");
  PrimitiveArrays arrays;
  for (const char* kind : {"JOINTS_", "WEIGHTS_"}) {
    for (int set = 0;; ++set) {
      const std::string attribute = kind + std::to_string(set);
      if (findMember(attributes, attribute.c_str()) == nullptr) break;
      const auto accessor = readIndexMember(attributes, attribute.c_str());
      if (!accessor) buffers.fail(name + ": its " + attribute + " is not an accessor");
      arrays[attribute] = buffers.readFloats(*accessor, kJointsOfSet);
    }
  }
  return arrays;
}

}  // namespace

std::map<std::size_t, RestPose> separatePosedMeshes(Json& gltf, GltfBuffers& buffers,
                                                    std::vector<Diagnostic>& problems) {
  std::map<std::size_t, RestPose> poses;
  const Json &nodes = getArray(gltf, "nodes"), &skins = getArray(gltf, "skins");
  const auto meshes = gltf.find("meshes");
  if (meshes == gltf.end() || !meshes->is_array()) return poses;
  const bool morphs = std::ranges::any_of(*meshes, [](const Json& mesh) {
    return std::ranges::any_of(getArray(mesh, "primitives"), [](const Json& primitive) {
      return findMember(&primitive, "targets") != nullptr;
    });
  });
  if (skins.empty() && !morphs) return poses;
  const NodeHierarchy hierarchy(nodes);
  for (std::size_t n = 0; n < nodes.size(); ++n) {
    const auto mesh = readIndexMember(&nodes[n], "mesh"), skin = readIndexMember(&nodes[n], "skin");
    if (!mesh || *mesh >= meshes->size()) continue;
    RestPose pose{*mesh, readMorphWeights(nodes[n], (*meshes)[*mesh]), {}};
    if (skin) {
      const std::string name = "skins[" + std::to_string(*skin) + "]";
      if (*skin >= skins.size()) buffers.fail(name + " does not exist");
      const Affine3d nodeFromWorld = hierarchy.worldFromNode(n).inverse();
      if (nodeFromWorld.matrix().allFinite()) {
        pose.nodeFromJoint = placeJoints(skins[*skin], nodeFromWorld, hierarchy, buffers, name);
      } else {  // a node of no size
        addDiagnostic(problems, "skin_ignored", "nodes[" + std::to_string(n) + "]");
      }
    }
    if (pose.morphWeights.empty() && pose.nodeFromJoint.empty()) continue;
    gltf["nodes"][n]["mesh"] = meshes->size();
    poses[meshes->size()] = std::move(pose);
    meshes->push_back(Json((*meshes)[*mesh]));
  }
  return poses;
}

void applyMorphTargets(const RestPose& pose, const Json& targets, GltfBuffers& buffers,
                       const std::string& name, PrimitiveArrays& arrays) {
  for (std::size_t t = 0; t < std::min(targets.size(), pose.morphWeights.size()); ++t) {
    const auto weight = static_cast<float>(pose.morphWeights[t]);
    if (weight == 0) continue;
    for (const char* attribute : {"POSITION", "NORMAL"}) {
      const auto accessor = readIndexMember(&targets[t], attribute);
      const auto base = arrays.find(attribute);
      if (!accessor || base == arrays.end()) continue;
      const std::vector<float> offsets = buffers.readFloats(*accessor, 3);
      if (offsets.size() != base->second.size())
        buffers.fail(name + ": morph target " + std::to_string(t) +
                     " has another number of vertices");
      for (std::size_t i = 0; i < offsets.size(); ++i) base->second[i] += weight * offsets[i];
    }
  }
}

void applySkin(const RestPose& pose, GltfBuffers& buffers, const std::string& name,
               PrimitiveArrays& arrays) {
  std::vector<float>& positions = arrays.at("POSITION");
  const std::size_t vertices = positions.size() / 3;
  std::vector<Eigen::Matrix4d> blended(vertices, Eigen::Matrix4d::Zero());
  visitWeights(pose, vertices, buffers, name, arrays,
               [&](std::size_t vertex, std::size_t joint, double weight) {
                 blended[vertex] += weight * pose.nodeFromJoint[joint].matrix();
               });
  const auto normals = arrays.find("NORMAL");
  for (std::size_t v = 0; v < vertices; ++v) {
    const double sum = blended[v](3, 3);  // of the weights; rounded ones rarely add up to 1
    const Affine3d transform(sum > 0 ? Eigen::Matrix4d(blended[v] / sum)
                                     : pose.nodeFromJoint.front().matrix());
    setVector(positions, v, transform * getVector(positions, v));
    if (normals != arrays.end() && normals->second.size() == positions.size())
      setVector(normals->second, v,
                transformNormal(transform.linear(), getVector(normals->second, v)));
  }
}

Aabb computePosedBox(const RestPose& pose, const Aabb& box, const Json& primitive,
                     GltfBuffers& buffers, const std::string& name) {
  const PrimitiveArrays arrays = readInfluences(primitive, buffers, name);
  const auto joints = arrays.find("JOINTS_0");
  const std::size_t vertices = joints == arrays.end() ? 0 : joints->second.size() / kJointsOfSet;
  std::vector<double> sums(vertices);
  std::vector<bool> used(pose.nodeFromJoint.size());
  visitWeights(pose, vertices, buffers, name, arrays,
               [&](std::size_t vertex, std::size_t joint, double weight) {
                 if (!(weight > 0)) buffers.fail(name + ": has a negative weight");
                 sums[vertex] += weight;
                 used[joint] = true;
               });
  // Vertices without weights follow the first joint.
  used[0] = used[0] || vertices == 0 || std::ranges::count(sums, 0.0) > 0;
  Aabb posed;
  for (std::size_t joint = 0; joint < used.size(); ++joint) {
    for (unsigned corner = 0; used[joint] && corner < 8; ++corner)
      posed.include(pose.nodeFromJoint[joint] * computeBoxCorner(box, corner));
  }
  return posed;
}

}  // namespace enfilade::scene
