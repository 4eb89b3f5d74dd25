#include "server/plans/path_style.hpp"

#include <algorithm>
#include <array>
#include <cmath>
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

double toLinear(std::uint8_t part) {
  const double s = part / 255.0;
  return s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
}

double computeLuminance(const Colour& colour) {
  return 0.2126 * toLinear(colour[0]) + 0.7152 * toLinear(colour[1]) + 0.0722 * toLinear(colour[2]);
}

}  // namespace

Colour makeReadable(Colour colour) {
  constexpr double kContrast = 4.5, kFlare = 0.05;
  const double brightest = (computeLuminance(kPlanPaper) + kFlare) / kContrast - kFlare;
  while (computeLuminance(colour) > brightest) colour = darken(colour, 0.95);
  return colour;
}

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
