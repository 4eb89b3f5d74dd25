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

Shape chairShape(Paint wood, Paint seat);
Shape stoolShape();
Shape armchairShape(Paint cloth);
Shape sofaShape(Paint cloth, double width);
Shape tableShape(double depth, double width, Paint wood);
Shape roundTableShape(double radius, Paint wood);
Shape vaseShape(int kind, Paint glaze);
Shape sculptureShape(int kind, Paint stone);
Shape pottedPlantShape(Random& random);
Shape globeShape();
Shape floorLampShape();
Shape tableLampShape();
Shape pendantShape(double cord, Paint shade);
Shape spotShape();
Shape radiatorShape(double width);
Shape stanchionShape();
/// A rug flat on the floor; `low`, `high` are its corners in x and z.
Shape rugShape(double sizeX, double sizeZ, Paint ground, Paint border);

/// An upholstered bench whose legs are separate objects.
void placeBench(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                Paint cloth);
/// A glass case on a base with an exhibit in it.
void placeDisplayCase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                      Random& random);
/// A plinth with a sculpture or a vase on it.
void placePlinth(Sketch& sketch, const std::string& path, const Spot& spot, double height,
                 const Shape& exhibit);
/// A bookcase whose boards and books are separate objects; its back is at x = 0.
void placeBookcase(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                   double height, Random& random);
/// A table with food, and chairs around it.
void placeCafeTable(Sketch& sketch, const std::string& path, const Spot& spot, int chairs);
/// A framed picture on a wall; `at` is its centre, on the wall's face.
void placePicture(Sketch& sketch, const std::string& path, const Spot& spot, double width,
                  double height, Random& random);

}  // namespace enfilade::assets
