// Walls with openings, and their skirting, cornices, frames, windows and doors.
#pragma once

#include <string>
#include <vector>

#include "assets/sketch.hpp"

namespace enfilade::assets {

/// A vertical wall along X (its thickness along Z) or along Z (its thickness along X).
struct Wall {
  enum class Axis : std::uint8_t { x, z };
  Axis along;
  double from, to;     ///< along its length
  double low, high;    ///< across its thickness: the coordinates of its two faces
  double bottom, top;  ///< y
  Paint lowFace, highFace;
  Paint ends = Paint::reveal;
};

/// A hole through a wall.
struct Opening {
  double from, to;     ///< along the wall
  double bottom, top;  ///< y
};

/// A point given along the wall, up, and across its thickness.
Vec3 makeWallPoint(Wall::Axis along, double a, double y, double across);
/// The box between two such points.
void placeWallBox(Sketch& sketch, const std::string& path, Wall::Axis along, const Vec3& low,
                  const Vec3& high, Paint paint);

/// Builds the wall of vertical strips between the openings, with pieces above and below them.
void addWall(Sketch& sketch, const std::string& path, const Wall& wall,
             const std::vector<Opening>& openings);

/// One face of a wall, seen from a room. `face` is its coordinate across the wall; `inward` is +1
/// if the room lies at greater coordinates.
struct Face {
  Wall::Axis along;
  double from, to;
  double face;
  double inward;
};
void addSkirting(Sketch& sketch, const std::string& path, const Face& face, double floor,
                 const std::vector<Opening>& openings);
void addCornice(Sketch& sketch, const std::string& path, const Face& face, double ceiling);
/// A moulded rail at the height `y`, all along.
void addRail(Sketch& sketch, const std::string& path, const Face& face, double y, double height,
             double depth, Paint paint);

/// Adds the casing on the low or the high face, and an architrave over the lintel.
void addCasing(Sketch& sketch, const std::string& path, const Wall& wall, const Opening& hole,
               bool high, Paint paint);
/// Casings on both faces.
void addDoorFrame(Sketch& sketch, const std::string& path, const Wall& wall, const Opening& hole,
                  Paint paint);
void addThreshold(Sketch& sketch, const std::string& path, const Wall& wall, const Opening& hole,
                  Paint paint);

/// One door leaf from its `hinge` (on the floor) to its `tip` at the distance `width`. `closes` is
/// the number of quarter turns about +Y from the modelled to the closed state.
struct Leaf {
  Vec3 hinge;
  int quarters;  ///< direction of the leaf: 0 is +X, 1 is -Z, ...
  double width, height;
  double closes;
  bool glazed = false;
};
void addLeaf(Sketch& sketch, const std::string& path, const Leaf& leaf);

/// A casement with mullions, panes and sill. Curtains hang on the inner side unless `curtain` is
/// glass.
struct WindowStyle {
  int columns = 2, rows = 3;
  Paint curtain = Paint::glass;
  double inward = 1;  ///< +1 if the room lies at greater coordinates across the wall
  bool sill = true;
};
void addWindow(Sketch& sketch, const std::string& path, const Wall& wall, const Opening& hole,
               const WindowStyle& style);

}  // namespace enfilade::assets
