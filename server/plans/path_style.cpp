#include "server/plans/path_style.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>

namespace enfilade::server {
namespace {

using render::Colour;
using render::LineKind;

struct Variation {
  double brightness;
  LineKind line;
};
/// Of paths with one colour, in their order; more start again.
constexpr std::array<Variation, 4> kVariations{{{1, LineKind::solid},
                                                {0.7, LineKind::longDashes},
                                                {0.45, LineKind::dashDot},
                                                {1, LineKind::dotted}}};

Colour darken(Colour colour, double brightness) {
  for (std::uint8_t& part : colour) part = static_cast<std::uint8_t>(brightness * part);
  return colour;
}

Colour makePale(Colour colour) {
  for (std::uint8_t& part : colour) part = static_cast<std::uint8_t>((part + 255) / 2);
  return colour;
}

}  // namespace

std::vector<PathStyle> makePathStyles(const std::vector<WalkedPath>& paths) {
  std::map<Colour, std::set<scene::EntityId>> avatars;  // in the order of their ids
  for (const WalkedPath& path : paths) avatars[computeAvatarColour(path.id)].insert(path.id);
  std::vector<PathStyle> styles;
  for (const WalkedPath& path : paths) {
    const Colour own = computeAvatarColour(path.id);
    const std::set<scene::EntityId>& sharers = avatars[own];
    const auto index =
        static_cast<std::size_t>(std::distance(sharers.begin(), sharers.find(path.id)));
    const Variation& variation = kVariations[index % kVariations.size()];
    const Colour colour = darken(own, variation.brightness);
    styles.push_back(path.isEarlier ? PathStyle{makePale(colour), LineKind::dashed}
                                    : PathStyle{colour, variation.line});
  }
  return styles;
}

}  // namespace enfilade::server
