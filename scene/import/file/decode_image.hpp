// Decodes PNG, JPEG and WebP images.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <variant>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Returns the image, halved until no side exceeds `maxSide`, or the reason why it cannot be
/// decoded.
std::variant<Texture, std::string> decodeImage(std::span<const std::byte> bytes,
                                               std::uint32_t maxSide);

/// Halves both sides by averaging 2 x 2 pixels; a side of one pixel stays.
void halveTexture(Texture& texture);

}  // namespace enfilade::scene
