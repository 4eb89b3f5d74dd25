// The parts of the bundled building that makeBuilding() assembles: wings, hall, stair, lift,
// furniture and grounds.
#pragma once

#include "assets/furniture.hpp"
#include "assets/plan.hpp"
#include "assets/walls.hpp"

namespace enfilade::assets {

/// Floors, ceilings, walls, doors and windows of the wings.
void addWings(Sketch& sketch, Random& random);
/// The hall's walls, floor, gallery, columns, skylight.
void addHall(Sketch& sketch, Random& random);
void addStair(Sketch& sketch);
/// Railings along the edge of the void, open at the head of the stair.
void addGalleryRailing(Sketch& sketch);
void addLift(Sketch& sketch);
void furnishEnfilade(Sketch& sketch, Random& random);
void furnishSideRooms(Sketch& sketch, Random& random);
void furnishHall(Sketch& sketch, Random& random);
void furnishUpperFloor(Sketch& sketch, Random& random);
/// Roofs, steps, paving, trees, hedges.
void addGrounds(Sketch& sketch, Random& random);

/// A floor of boards or tiles in the given tones; its top is at high.y.
enum class FloorPattern : std::uint8_t { boardsAlongX, boardsAlongZ, squares };
void addFloor(Sketch& sketch, const std::string& path, const Vec3& low, const Vec3& high,
              FloorPattern pattern, double cell, const std::vector<Paint>& tones, Random& random);
/// A rectangular room between the faces of its walls.
struct RoomBox {
  double west, east, north, south, floor, ceiling;
};
void addTree(Sketch& sketch, const std::string& path, const Vec3& foot, Random& random);

}  // namespace enfilade::assets
