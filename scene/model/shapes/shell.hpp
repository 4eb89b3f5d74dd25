// Shell: a connected surface of a shape, and whether it bounds a solid.
#pragma once

#include <cstdint>

namespace enfilade::scene {

/// A connected surface: triangles joined by edges that exactly two of them share.
struct Shell {
  enum class Kind : std::uint8_t {
    open,    ///< an edge has one triangle, or three and more, or the surface is one-sided (Möbius
             ///< strip)
    closed,  ///< each edge has two triangles; it bounds a solid that is not convex
    convex,  ///< closed; every triangle lies exactly in a face of the vertices' hull
    nearlyConvex,  ///< closed; convex up to the rounding of the coordinates (convex_surface.hpp)
  };
  Kind kind = Kind::open;
  bool inward = false;      ///< closed: its faces look into the enclosed volume
  bool hollow = false;      ///< closed and outward: another surface faces into its inside, a cavity
  std::uint32_t first = 0;  ///< into Shape::triangles
  std::uint32_t count = 0;  ///< at least 1

  bool bounds() const { return kind != Kind::open; }
  bool isConvex() const { return kind == Kind::convex || kind == Kind::nearlyConvex; }
};

}  // namespace enfilade::scene
