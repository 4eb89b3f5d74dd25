#include "scene/import/bodies/name_suffixes.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "scene/import/bodies/body_precedence.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr std::string_view kDigits = "0123456789";

/// Removes `mark` and the digits after it from the end of a name.
std::string_view stripNumber(std::string_view name, char mark) {
  const std::size_t end = name.find_last_not_of(kDigits);
  const bool numbered = end != std::string_view::npos && end + 1 < name.size() && name[end] == mark;
  return numbered && end > 0 ? name.substr(0, end) : name;
}

std::string_view stripNumbers(std::string_view name) {
  return stripNumber(stripNumber(name, '#'), '.');
}

struct Segments {
  std::string_view above;  ///< with the final '/', or empty
  std::string_view name;
};

Segments splitPath(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return {"", path};
  return {path.substr(0, slash + 1), path.substr(slash + 1)};
}

bool removeSuffix(std::string_view& name, std::string_view end) {
  if (name.size() <= end.size() || !name.ends_with(end)) return false;
  name.remove_suffix(end.size());
  return true;
}

enum class NameHint : std::uint8_t { none, solid, shape, rigid };

/// Meaning of a name, and the object that it refers to.
struct ParsedName {
  NameHint hint = NameHint::none;
  std::string_view target;
  bool needsTarget = false;  ///< a shape that is useless without its target
};

ParsedName parseName(std::string_view name) {
  name = stripNumbers(name);
  for (const std::string_view prefix : {"UCX_", "UBX_", "UCP_", "USP_"})
    if (name.starts_with(prefix) && name.size() > prefix.size())
      return {NameHint::shape, name.substr(prefix.size()), true};
  static constexpr std::array<std::pair<std::string_view, NameHint>, 5> kSuffixes{
      {{"-colonly", NameHint::shape},
       {"-convcolonly", NameHint::shape},
       {"-col", NameHint::solid},
       {"-convcol", NameHint::solid},
       {"-rigid", NameHint::rigid}}};
  for (const auto& [suffix, hint] : kSuffixes)
    if (removeSuffix(name, suffix)) return {hint, name, false};
  return {};
}

class NamedBodyBuilder {
 public:
  explicit NamedBodyBuilder(Model& model) : model_(model) {}

  void apply(std::uint32_t index) {
    // a copy: byName_ refers to the model's own
    const std::string path = model_.objects[index].path;
    const auto [above, name] = splitPath(path);
    const auto [hint, target, needsTarget] = parseName(name);
    if (hint == NameHint::none || model_.objects[index].usage != Object::Usage::both) return;
    addDiagnostic(model_.diagnostics, "collision_suffix", path);
    if (hint == NameHint::shape) makeShape(index, above, target, needsTarget);
    if (hint == NameHint::rigid) {
      BodySpec body;
      body.name = path;
      body.source = BodySource::suffix;
      body.objects = {index};
      bodies_.push_back(std::move(body));
    }
  }

  std::vector<BodySpec> takeBodies() { return std::move(bodies_); }

 private:
  void makeShape(std::uint32_t index, std::string_view above, std::string_view target,
                 bool needsTarget) {
    Object& shape = model_.objects[index];
    shape.usage = Object::Usage::collisionOnly;
    std::optional<std::uint32_t> drawn = findTarget(index, above, target);
    if (!drawn) drawn = findTarget(index, above, stripNumber(target, '_'));
    if (!drawn && needsTarget)
      addDiagnostic(model_.diagnostics, "collision_shape_alone",
                    shape.path + ": solid and invisible");
    if (!drawn) return;
    shape.partOf = *drawn;
    model_.objects[*drawn].usage = Object::Usage::visualOnly;
  }

  /// Most files have no shapes by name, and some have a million objects.
  void indexNames() {
    if (!byName_.empty()) return;
    for (std::uint32_t i = 0; i < model_.objects.size(); ++i)
      byName_.emplace(stripNumbers(splitPath(model_.objects[i].path).name), i);
  }

  /// Returns the target: a sibling, else the only object of that name.
  std::optional<std::uint32_t> findTarget(std::uint32_t index, std::string_view above,
                                          std::string_view name) {
    indexNames();
    std::optional<std::uint32_t> sibling, anywhere;
    std::size_t count = 0;
    const auto [begin, end] = byName_.equal_range(name);
    for (auto at = begin; at != end; ++at) {
      if (at->second == index || model_.objects[at->second].usage == Object::Usage::collisionOnly)
        continue;
      const bool isSibling = splitPath(model_.objects[at->second].path).above == above;
      if (isSibling && !sibling) sibling = at->second;
      if (!anywhere) anywhere = at->second;
      ++count;
    }
    if (sibling) return sibling;
    return count == 1 ? anywhere : std::nullopt;
  }

  Model& model_;
  std::multimap<std::string_view, std::uint32_t> byName_;  // refers to the model's own paths
  std::vector<BodySpec> bodies_;
};

}  // namespace

void addNamedBodies(Model& model, const std::set<std::uint32_t>& staticObjects) {
  const auto count = static_cast<std::uint32_t>(model.objects.size());
  NamedBodyBuilder named(model);
  for (std::uint32_t i = 0; i < count; ++i) named.apply(i);
  mergeLowerPriorityBodies(model, named.takeBodies(), staticObjects);
  attachCollisionShapes(model);
}

}  // namespace enfilade::scene
