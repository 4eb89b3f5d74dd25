#include "scene/model/up_axis.hpp"

#include <algorithm>
#include <array>
#include <iterator>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

constexpr std::array<std::string_view, 6> kNames{"x", "y", "z", "-x", "-y", "-z"};  // as UpAxis

}  // namespace

UpAxis negate(UpAxis positive) {
  ENFILADE_ASSERT(positive <= UpAxis::z);
  return static_cast<UpAxis>(static_cast<int>(positive) + static_cast<int>(UpAxis::minusX));
}

std::string toString(UpAxis up) {
  return std::string(kNames[static_cast<std::size_t>(up)]);
}

std::optional<UpAxis> parseUpAxis(std::string_view text) {
  const auto found = std::ranges::find(kNames, text);
  if (found == kNames.end()) return std::nullopt;
  return static_cast<UpAxis>(std::distance(kNames.begin(), found));
}

}  // namespace enfilade::scene
