// Furniture and exhibits. Shapes stand on y = 0 around the origin and face +X; the comments name
// the functions that place several objects.
#pragma once

#include <string>

#include "assets/random.hpp"
#include "assets/sketch.hpp"

namespace enfilade::assets {

/// Position of a piece: its origin on the floor, and its direction (quarter turns about +Y).
struct Spot {
  Vec3 at;
  int quarters = 0;
};

PaintedMesh makeChairShape(Paint wood, Paint seat);
PaintedMesh makeStoolShape();
PaintedMesh makeArmchairShape(Paint cloth);
PaintedMesh makeSofaShape(Paint cloth, double width);
PaintedMesh makeTableShape(double depth, double width, Paint wood);
PaintedMesh makeRoundTableShape(double radius, Paint wood);
PaintedMesh makeVaseShape(int kind, Paint glaze);
PaintedMesh makeSculptureShape(int kind, Paint stone);
PaintedMesh makePottedPlantShape(Random& random);
PaintedMesh makeGlobeShape();
PaintedMesh makeFloorLampShape();
PaintedMesh makeTableLampShape();
PaintedMesh makePendantShape(double cord, Paint shade);
PaintedMesh makeSpotShape();
PaintedMesh makeRadiatorShape(double width);
PaintedMesh makeStanchionShape();
/// A rug flat on the floor; `low`, `high` are its corners in x and z.
PaintedMesh makeRugShape(double sizeX, double sizeZ, Paint ground, Paint border);

/// An upholstered bench whose legs are separate objects.
void placeBench(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                Paint cloth);
/// A glass case on a base with an exhibit in it.
void placeDisplayCase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                      Random& random);
/// A plinth with a sculpture or a vase on it.
void placePlinth(Sketch& sketch, const std::string& path, const Spot& spot, double height,
                 const PaintedMesh& exhibit);
/// A bookcase whose boards and books are separate objects; its back is at x = 0.
void placeBookcase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                   double height, Random& random);
/// A table with food, and chairs around it.
void placeCafeTable(Sketch& sketch, const std::string& path, const Spot& spot, int chairs);
/// A framed picture on a wall; `at` is its centre, on the wall's face.
void placePicture(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                  double height, Random& random);

}  // namespace enfilade::assets
