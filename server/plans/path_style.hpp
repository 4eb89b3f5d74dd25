// Colours and dashes of paths on maps, and colours of other marks.
#pragma once

#include <vector>

#include "server/plans/walk_trace.hpp"

namespace enfilade::server {

inline constexpr render::Colour kContactColour{214, 40, 40}, kBlockedColour{120, 0, 120};

struct PathStyle {
  render::Colour colour{};
  render::LineKind line = render::LineKind::solid;
};

/// The styles of a map's paths: each has its avatar's colour. Paths whose avatars share a colour
/// differ in lightness and dashes. Earlier paths are pale and dashed.
std::vector<PathStyle> makePathStyles(const std::vector<WalkedPath>& paths);

/// The colour, darkened as far as text of it needs on the paper of a plan: contrast 4.5 (WCAG 2.1).
render::Colour makeReadable(render::Colour colour);

}  // namespace enfilade::server
