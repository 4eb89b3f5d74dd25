// Bodies that a glTF file tells: its physics extension first, then extras of its nodes, `walk_kind`
// and the other words of SIDECAR.md with `walk_` before them.
#include "scene/import/bodies/gltf_bodies.hpp"

#include <algorithm>
#include <set>

#include "scene/import/bodies/body_fields.hpp"
#include "scene/import/bodies/body_precedence.hpp"
#include "scene/import/bodies/sidecar.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr const char* kPrefix = "walk_";

bool hasWalkKeys(const Json& node) {
  const auto extras = node.find("extras");
  if (extras == node.end() || !extras->is_object()) return false;
  return std::any_of(extras->items().begin(), extras->items().end(),
                     [](const auto& item) { return item.key().rfind(kPrefix, 0) == 0; });
}

/// Where extras give no axis, it is the scene's up, or for what slides the node's x; points and
/// directions that they give are in the node's frame.
void place(const BodyFields& fields, const Eigen::Affine3d& worldFromNode, BodySpec& body) {
  const bool ofNode = fields.axis || body.kind == BodyKind::sliding;
  if (ofNode) body.axis = (worldFromNode.linear() * body.axis).normalized();
  body.anchor = worldFromNode * body.anchor;
}

class ExtrasReader {
 public:
  ExtrasReader(const std::filesystem::path& file, GltfTree& tree)
      : file_(file.filename().string()), tree_(tree) {
    for (const auto& [number, place] : tree.places()) {
      if (!hasWalkKeys(tree.node(number))) continue;
      if (tree.node(number).at("extras").contains("walk_kind")) {
        marked_.insert(number);
      } else {  // perhaps the words of another program
        addProblem(tree.model(), "extras_without_kind",
                   "node '" + place.path + "': has walk_* but no walk_kind; it is no body");
      }
    }
  }

  std::vector<BodySpec> read(std::set<std::uint32_t>& still) {
    const OwnedObjects owned = tree_.objectsByOwner(marked_);
    std::vector<BodySpec> bodies;
    for (const std::size_t number : marked_) {
      const std::string& path = tree_.places().at(number).path;
      const JsonPlace extras{tree_.node(number).at("extras"),
                             file_ + ": node '" + path + "': extras", kPrefix};
      const auto objects = owned.find(number);
      if (objects == owned.end())
        extras.fail("neither the node nor one below it has a mesh that could move");
      if (extras.at("kind").value == "still") {
        still.insert(objects->second.begin(), objects->second.end());
      } else {
        bodies.push_back(bodyOf(extras, number, objects->second));
      }
    }
    return bodies;
  }

 private:
  BodySpec bodyOf(const JsonPlace& extras, std::size_t number,
                  const std::vector<std::uint32_t>& objects) const {
    BodySpec body;
    body.source = BodySource::extras;
    body.name = extras.has("name") ? textOf(extras.at("name")) : tree_.places().at(number).path;
    body.objects = objects;
    body.kind = kindOf(extras);
    const BodyFields fields = readBodyFields(extras, {}, body);
    place(fields, tree_.worldFromNode(number), body);
    return body;
  }

  std::string file_;
  GltfTree& tree_;
  std::set<std::size_t> marked_;
};

const Json kNothing = Json::object();

}  // namespace

GltfTree::GltfTree(const Json& file, const NodePlaces& places, Model& model)
    : file_(file), places_(places), model_(model) {
  for (std::uint32_t i = 0; i < model.objects.size(); ++i)
    objectOfPath_.emplace(model.objects[i].path, i);
}

const Json& GltfTree::node(std::size_t number) const {
  const auto nodes = file_.find("nodes");
  const bool there = nodes != file_.end() && nodes->is_array() && number < nodes->size() &&
                     (*nodes)[number].is_object();
  return there ? (*nodes)[number] : kNothing;
}

std::optional<std::uint32_t> GltfTree::objectOf(std::size_t number) const {
  const auto place = places_.find(number);
  if (place == places_.end()) return std::nullopt;
  const auto object = objectOfPath_.find(place->second.path);
  return object == objectOfPath_.end() ? std::nullopt : std::optional(object->second);
}

Eigen::Affine3d GltfTree::worldFromNode(std::size_t number) const {
  return Eigen::Translation3d(-model_.offset) * places_.at(number).worldFromNode;
}

std::set<std::uint32_t> addGltfBodies(const std::filesystem::path& file, ModelFormat format,
                                      const NodePlaces& places, Model& model) {
  const std::string text = gltfText(file, format);
  const bool says = text.find("walk_") != std::string::npos ||
                    text.find("KHR_physics_rigid_bodies") != std::string::npos;
  if (!says) return {};
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return {};
  std::set<std::uint32_t> still;
  try {
    GltfTree tree(json, places, model);
    addLowerBodies(model, physicsBodies(tree), {});
    std::vector<BodySpec> ofExtras = ExtrasReader(file, tree).read(still);
    addLowerBodies(model, std::move(ofExtras), still);
    takeCollisionShapesAlong(model);
  } catch (const SidecarError& error) {
    throw ImportError(std::string(error.what()) + " (convert)");
  }
  if (const auto why = refusalOfBodies(model))
    throw ImportError(file.filename().string() + ": " + *why +
                      "; correct the node's extras (convert)");
  return still;
}

}  // namespace enfilade::scene
