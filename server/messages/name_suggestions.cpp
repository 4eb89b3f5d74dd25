#include "server/messages/name_suggestions.hpp"

#include <algorithm>
#include <span>
#include <vector>

#include "protocol/nearest_word.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::server {
namespace {

constexpr std::size_t kMaxCompared = 1000;  // names: about 1 ms

/// The nearest name, otherwise the first one that contains `typed`; "" without one.
std::string findSimilarName(const std::string& typed, std::span<const std::string> names) {
  const std::string nearest = protocol::findNearestWord(typed, names);
  if (!nearest.empty() || typed.empty()) return nearest;
  const auto longer = std::ranges::find_if(
      names, [&](const std::string& name) { return name.find(typed) != std::string::npos; });
  return longer == names.end() ? "" : *longer;
}

template <class Named>
std::vector<std::string> collectNames(const std::vector<Named>& all) {
  std::vector<std::string> names;
  for (const Named& one : std::span(all).first(std::min(kMaxCompared, all.size())))
    names.push_back(one.name);
  return names;
}

std::string suggestName(const std::string& typed, std::span<const std::string> names,
                        const std::string& what, const std::string& without) {
  if (names.empty()) return without;
  if (const std::string similar = findSimilarName(typed, names); !similar.empty())
    return "; did you mean '" + similar + "'?";
  constexpr std::size_t kMaxListed = 5;
  std::string list;
  for (const std::string& name : names.first(std::min(kMaxListed, names.size())))
    list += (list.empty() ? "'" : ", '") + name + "'";
  return "; the " + what + " are " + list + (names.size() > kMaxListed ? ", ..." : "");
}

}  // namespace

std::string suggestAvatar(const scene::World& world, const std::string& name) {
  if (world.data().findAvatarByName(name)) return "";  // it has entered since
  return suggestName(name, collectNames(world.data().avatars), "avatars", "; spawn it first");
}

std::string suggestBody(const scene::World& world, const std::string& name) {
  if (world.data().findBodyByName(name)) return "";
  return suggestName(name, collectNames(world.scene().model().bodies), "bodies",
                     "; the scene has no bodies");
}

std::string suggestBodies(const scene::World& world, const v1::Command& command) {
  std::string text;
  for (const std::string& door : command.walk().opens())
    if (text.empty()) text = suggestBody(world, door);
  for (const v1::Walk::Ride& ride : command.walk().rides())
    if (text.empty()) text = suggestBody(world, ride.lift());
  return text;
}

}  // namespace enfilade::server
