// Which patches can be solved at the same time: those that share no body that moves. Patches of one
// colour share none, so the order among them, and who solves them, changes nothing.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "scene/physics/contact_constraint.hpp"

namespace enfilade::scene {

struct Colouring {
  std::vector<std::uint32_t> order;  ///< indices of all patches, by colour, ascending in each
  /// Where each colour ends in `order`. The last one holds what found no colour: those have to be
  /// solved one after another.
  std::vector<std::uint32_t> ends;
};

/// Of fewer patches, those that share a body that moves come in the order that they have: it is the
/// better one for stacks, whose patches come from the ground up.
inline constexpr std::size_t kFewPatches = 192;

/// `moves`: of each body, whether impulses move it.
Colouring colourPatches(std::span<const ContactPatch> patches, std::span<const std::uint8_t> moves);

}  // namespace enfilade::scene
