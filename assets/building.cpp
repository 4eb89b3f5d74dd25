#include "assets/building.hpp"

#include "assets/parts.hpp"

namespace enfilade::assets {

scene::Model makeBuilding(const BuildingOptions& options, std::vector<MovingPart>* movingParts) {
  if (options.objects > 0) return makeDistrict(options.objects, options.seed);
  Sketch sketch;
  Random random(options.seed);
  addWings(sketch, random);
  addHall(sketch, random);
  addStair(sketch);
  addGalleryRailing(sketch);
  addLift(sketch);
  furnishEnfilade(sketch, random);
  furnishSideRooms(sketch, random);
  furnishHall(sketch, random);
  furnishUpperFloor(sketch, random);
  addGrounds(sketch, random);
  sketch.model().source = "bundled building, seed " + std::to_string(options.seed);
  if (movingParts) *movingParts = sketch.movingParts();
  return std::move(sketch.model());
}

}  // namespace enfilade::assets
