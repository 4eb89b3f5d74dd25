// Greedily, in the order of the patches: the first colour that neither body has yet; or, where the
// order counts, the first after all that they have.
#include "scene/physics/graph_coloring.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <numeric>

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kColours = 32;

/// The colour of a patch is the first after those of all patches before it that share a body with
/// it.
Colouring ranked(std::span<const ContactPatch> patches, std::span<const std::uint8_t> moves) {
  std::vector<std::uint32_t> after(moves.size(), 0), ranks(patches.size());
  std::uint32_t count = 0;
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const std::uint32_t a = patches[k].a, b = patches[k].b;
    ranks[k] = std::max(moves[a] ? after[a] : 0, moves[b] ? after[b] : 0);
    after[a] = after[b] = ranks[k] + 1;
    count = std::max(count, ranks[k] + 1);
  }
  Colouring colouring;
  colouring.order.resize(patches.size());
  std::iota(colouring.order.begin(), colouring.order.end(), 0u);
  std::stable_sort(colouring.order.begin(), colouring.order.end(),
                   [&](std::uint32_t k, std::uint32_t l) { return ranks[k] < ranks[l]; });
  colouring.ends.assign(count + 1, 0);
  for (const std::uint32_t rank : ranks) ++colouring.ends[rank];
  std::partial_sum(colouring.ends.begin(), colouring.ends.end(), colouring.ends.begin());
  return colouring;
}

}  // namespace

Colouring colourPatches(std::span<const ContactPatch> patches,
                        std::span<const std::uint8_t> moves) {
  if (patches.size() < kFewPatches) return ranked(patches, moves);
  std::vector<std::uint32_t> taken(moves.size(), 0), colours(patches.size());
  std::array<std::uint32_t, kColours + 1> counts{};
  for (std::size_t k = 0; k < patches.size(); ++k) {
    const std::uint32_t a = patches[k].a, b = patches[k].b;
    const std::uint32_t used = (moves[a] ? taken[a] : 0) | (moves[b] ? taken[b] : 0);
    const auto colour = static_cast<std::uint32_t>(std::countr_one(used));  // kColours: none left
    colours[k] = colour;
    ++counts[colour];
    if (colour == kColours) continue;
    taken[a] |= 1u << colour, taken[b] |= 1u << colour;
  }
  Colouring colouring;
  std::array<std::uint32_t, kColours + 1> next{};
  std::uint32_t end = 0;
  for (std::uint32_t colour = 0; colour <= kColours; ++colour) {
    next[colour] = end;
    end += counts[colour];
    if (counts[colour] > 0 || colour == kColours) colouring.ends.push_back(end);
  }
  colouring.order.resize(patches.size());
  for (std::uint32_t k = 0; k < patches.size(); ++k) colouring.order[next[colours[k]]++] = k;
  return colouring;
}

}  // namespace enfilade::scene
