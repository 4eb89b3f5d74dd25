// The axis of a file that points up. The scene is Y up.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace enfilade::scene {

enum class UpAxis : std::uint8_t { x, y, z, minusX, minusY, minusZ };
inline constexpr UpAxis kLastUpAxis = UpAxis::minusZ;

/// The opposite of x, y or z.
UpAxis negate(UpAxis positive);
/// "x", "y", "z", "-x", "-y" or "-z".
std::string toString(UpAxis up);
std::optional<UpAxis> parseUpAxis(std::string_view text);

}  // namespace enfilade::scene
