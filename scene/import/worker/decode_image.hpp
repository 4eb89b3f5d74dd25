// PNG and JPEG bytes to pixels.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <variant>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The picture, no side longer than `longestSide` (halved until it fits), or why it cannot be read.
std::variant<Texture, std::string> decodeImage(std::span<const std::byte> bytes,
                                               std::uint32_t longestSide);

/// Halves both sides (a side of one pixel stays), by the mean of each 2 x 2 pixels.
void halve(Texture& texture);

}  // namespace enfilade::scene
