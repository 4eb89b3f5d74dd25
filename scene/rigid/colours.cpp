// Greedily, in the order of the patches: the first colour that neither body has yet.
#include "scene/rigid/colours.hpp"

#include <array>
#include <bit>
#include <numeric>

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kColours = 32;

Colouring uncoloured(std::size_t size) {
  Colouring colouring;
  colouring.order.resize(size);
  std::iota(colouring.order.begin(), colouring.order.end(), 0u);
  colouring.ends = {static_cast<std::uint32_t>(size)};
  return colouring;
}

}  // namespace

Colouring colourPatches(std::span<const ContactPatch> patches,
                        std::span<const std::uint8_t> moves) {
  if (patches.size() < kFewPatches) return uncoloured(patches.size());
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
