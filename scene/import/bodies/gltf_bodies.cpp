#include "scene/import/bodies/gltf_bodies.hpp"

#include <algorithm>
#include <map>
#include <set>

#include "scene/import/bodies/body_fields.hpp"
#include "scene/import/bodies/body_precedence.hpp"
#include "scene/import/bodies/gltf_physics.hpp"
#include "scene/import/bodies/gltf_tree.hpp"
#include "scene/import/bodies/sidecar_error.hpp"
#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kPrefix = "walk_";

constexpr const char* kClassKey = "walk_class";

/// Whether the node's extras describe a body.
bool hasWalkKeys(const Json& node) {
  const auto extras = node.find("extras");
  if (extras == node.end() || !extras->is_object()) return false;
  return std::any_of(extras->items().begin(), extras->items().end(), [](const auto& item) {
    return item.key().rfind(kPrefix, 0) == 0 && item.key() != kClassKey;
  });
}

/// The class in the node's extras; "": none. Other programs use the key without the prefix.
std::string findClass(const Json& node) {
  const auto extras = node.find("extras");
  if (extras == node.end() || !extras->is_object()) return "";
  for (const char* key : {kClassKey, "class"})
    if (const auto found = extras->find(key); found != extras->end() && found->is_string())
      return found->get<std::string>();
  return "";
}

/// Sets the class of all objects below a node that has one. They are one thing.
void applyClasses(GltfTree& tree) {
  std::map<std::size_t, std::string> classOf;  // by node
  for (const auto& [number, transform] : tree.transforms())
    if (std::string name = findClass(tree.node(number)); !name.empty()) classOf[number] = name;
  for (const auto& [node, objects] : tree.groupObjectsByOwner(classOf))
    for (const std::uint32_t i : objects) {
      Object& object = tree.model().objects[i];
      object.className = classOf.at(node);
      if (objects.size() > 1) object.thing = objects.front();
    }
}

/// Transforms points and directions from the node to the scene. Without an axis in the extras, it
/// is the scene's up, or the node's x for a slider.
void toWorldFrame(const ExplicitBodyFields& fields, const Eigen::Affine3d& worldFromNode,
                  BodySpec& body) {
  const bool ofNode = fields.axis || body.kind == BodyKind::sliding;
  if (ofNode) body.axis = (worldFromNode.linear() * body.axis).normalized();
  body.anchor = worldFromNode * body.anchor;
}

class ExtrasReader {
 public:
  ExtrasReader(const std::filesystem::path& file, GltfTree& tree)
      : file_(file.filename().string()), tree_(tree) {
    for (const auto& [number, transform] : tree.transforms()) {
      if (!hasWalkKeys(tree.node(number))) continue;
      if (tree.node(number).at("extras").contains("walk_kind")) {
        marked_.insert(number);
      } else {  // perhaps keys of another program
        addDiagnostic(
            tree.model().diagnostics, "extras_without_kind",
            "node '" + transform.path + "': has walk_* but no walk_kind; it is not a body");
      }
    }
  }

  std::vector<BodySpec> read(std::set<std::uint32_t>& staticObjects) {
    const OwnedObjects owned = tree_.groupObjectsByOwner(marked_);
    std::vector<BodySpec> bodies;
    for (const std::size_t number : marked_) {
      const std::string& path = tree_.transforms().at(number).path;
      const JsonCursor extras{tree_.node(number).at("extras"),
                              file_ + ": node '" + path + "': extras", kPrefix};
      const auto objects = owned.find(number);
      if (objects == owned.end())
        extras.fail("neither the node nor one below it has a mesh that could move");
      if (extras.at("kind").value == "still") {
        staticObjects.insert(objects->second.begin(), objects->second.end());
      } else {
        bodies.push_back(readBody(extras, number, objects->second));
      }
    }
    return bodies;
  }

 private:
  BodySpec readBody(const JsonCursor& extras, std::size_t number,
                    const std::vector<std::uint32_t>& objects) const {
    BodySpec body;
    body.source = BodySource::extras;
    body.name =
        extras.has("name") ? readText(extras.at("name")) : tree_.transforms().at(number).path;
    body.objects = objects;
    body.kind = readBodyKind(extras);
    const ExplicitBodyFields fields = readBodyFields(extras, {}, body);
    toWorldFrame(fields, tree_.worldFromNode(number), body);
    return body;
  }

  std::string file_;
  GltfTree& tree_;
  std::set<std::size_t> marked_;
};

}  // namespace

bool mayHaveGltfBodies(const std::string& text) {
  return mentions(text, "walk_") || mentions(text, "KHR_physics_rigid_bodies") ||
         mentions(text, "\"class\"");
}

std::set<std::uint32_t> addGltfBodies(const std::filesystem::path& file, const std::string& text,
                                      const NodeTransforms& transforms, Model& model) {
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return {};
  std::set<std::uint32_t> staticObjects;
  try {
    GltfTree tree(json, transforms, model);
    applyClasses(tree);
    mergeLowerPriorityBodies(model, readPhysicsBodies(tree), {});
    std::vector<BodySpec> ofExtras = ExtrasReader(file, tree).read(staticObjects);
    mergeLowerPriorityBodies(model, std::move(ofExtras), staticObjects);
    attachCollisionShapes(model);
  } catch (const SidecarError& error) {
    throw ImportError(error.what());
  }
  if (const auto reason = validateBodies(model))
    throw ImportError(file.filename().string() + ": " + *reason + "; correct the node's extras");
  return staticObjects;
}

}  // namespace enfilade::scene
