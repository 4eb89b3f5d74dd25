// Verdict: the exact relation of two convex bodies.
#pragma once

#include <cstdint>

namespace enfilade::collision {

/// The relation of two bodies as closed sets. Touching: they share a point, and an arbitrarily
/// small translation separates them.
enum class Verdict : std::uint8_t { separated, touching, penetrating };

}  // namespace enfilade::collision
