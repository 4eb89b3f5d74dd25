// Bodies and collision shapes that names tell, by the conventions of two game engines:
//
//   Chair-col, -convcol          stands still and is solid, as all does (Godot's import hints)
//   Chair-colonly, -convcolonly  not drawn: the collision shape of Chair, or a wall of its own
//   Chair-rigid                  a free body
//   UCX_Chair, UCX_Chair_01      not drawn: a collision shape of Chair; also UBX_, UCP_, USP_
//   (Unreal)
//
// What modellers append to repeated names (".001", and "#2" of ours) does not count.
#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string_view>

#include "scene/import/assimp/convert_scene.hpp"
#include "scene/import/bodies/body_precedence.hpp"

namespace enfilade::scene {
namespace {

constexpr std::string_view kDigits = "0123456789";

/// Without `mark` and the digits behind it, where the name ends so.
std::string_view withoutNumber(std::string_view name, char mark) {
  const std::size_t end = name.find_last_not_of(kDigits);
  const bool numbered = end != std::string_view::npos && end + 1 < name.size() && name[end] == mark;
  return numbered && end > 0 ? name.substr(0, end) : name;
}

std::string_view plainName(std::string_view name) {
  return withoutNumber(withoutNumber(name, '#'), '.');
}

struct Segments {
  std::string_view above;  ///< with the '/' at its end, or empty
  std::string_view name;
};

Segments segmentsOf(std::string_view path) {
  const std::size_t slash = path.rfind('/');
  if (slash == std::string_view::npos) return {"", path};
  return {path.substr(0, slash + 1), path.substr(slash + 1)};
}

bool takeEnd(std::string_view& name, std::string_view end) {
  if (name.size() <= end.size() || !name.ends_with(end)) return false;
  name.remove_suffix(end.size());
  return true;
}

enum class Hint : std::uint8_t { none, still, shape, rigid };

/// What the name tells, and of whom it tells it.
struct Hinted {
  Hint hint = Hint::none;
  std::string_view of;
  bool mustBe = false;  ///< a shape that is of no use without whom it names
};

Hinted hintOf(std::string_view name) {
  name = plainName(name);
  for (const std::string_view prefix : {"UCX_", "UBX_", "UCP_", "USP_"})
    if (name.starts_with(prefix) && name.size() > prefix.size())
      return {Hint::shape, name.substr(prefix.size()), true};
  static constexpr std::array<std::pair<std::string_view, Hint>, 5> kSuffixes{
      {{"-colonly", Hint::shape},
       {"-convcolonly", Hint::shape},
       {"-col", Hint::still},
       {"-convcol", Hint::still},
       {"-rigid", Hint::rigid}}};
  for (const auto& [suffix, hint] : kSuffixes)
    if (takeEnd(name, suffix)) return {hint, name, false};
  return {};
}

class NamedBodies {
 public:
  explicit NamedBodies(Model& model) : model_(model) {
    for (std::uint32_t i = 0; i < model.objects.size(); ++i)
      byName_.emplace(plainName(segmentsOf(model.objects[i].path).name), i);
  }

  void apply(std::uint32_t index) {
    const std::string path = model_.objects[index].path;  // byName_ looks at the model's own
    const auto [above, name] = segmentsOf(path);
    const auto [hint, of, mustBe] = hintOf(name);
    if (hint == Hint::none || model_.objects[index].use != Object::Use::whole) return;
    addProblem(model_, "collision_suffix", path);
    if (hint == Hint::shape) makeShape(index, above, of, mustBe);
    if (hint == Hint::rigid) {
      BodySpec body;
      body.name = path;
      body.source = BodySource::suffix;
      body.objects = {index};
      bodies_.push_back(std::move(body));
    }
  }

  std::vector<BodySpec> take() { return std::move(bodies_); }

 private:
  void makeShape(std::uint32_t index, std::string_view above, std::string_view of, bool mustBe) {
    Object& shape = model_.objects[index];
    shape.use = Object::Use::solid;
    std::optional<std::uint32_t> drawn = find(index, above, of);
    if (!drawn) drawn = find(index, above, withoutNumber(of, '_'));
    if (!drawn && mustBe)
      addProblem(model_, "collision_shape_alone", shape.path + ": solid and not drawn");
    if (!drawn) return;
    shape.pieceOf = *drawn;
    model_.objects[*drawn].use = Object::Use::drawn;
  }

  /// Whom it names: one beside it, else the only one of that name.
  std::optional<std::uint32_t> find(std::uint32_t index, std::string_view above,
                                    std::string_view name) const {
    std::optional<std::uint32_t> beside, anywhere;
    std::size_t count = 0;
    const auto [begin, end] = byName_.equal_range(name);
    for (auto at = begin; at != end; ++at) {
      if (at->second == index || model_.objects[at->second].use == Object::Use::solid) continue;
      const bool isBeside = segmentsOf(model_.objects[at->second].path).above == above;
      if (isBeside && !beside) beside = at->second;
      if (!anywhere) anywhere = at->second;
      ++count;
    }
    if (beside) return beside;
    return count == 1 ? anywhere : std::nullopt;
  }

  Model& model_;
  std::multimap<std::string_view, std::uint32_t> byName_;  // into the model's own paths
  std::vector<BodySpec> bodies_;
};

}  // namespace

void addNamedBodies(Model& model, const std::set<std::uint32_t>& still) {
  const auto count = static_cast<std::uint32_t>(model.objects.size());
  NamedBodies named(model);
  for (std::uint32_t i = 0; i < count; ++i) named.apply(i);
  addLowerBodies(model, named.take(), still);
  takeCollisionShapesAlong(model);
}

}  // namespace enfilade::scene
