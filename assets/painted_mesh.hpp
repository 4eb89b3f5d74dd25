// Solids of triangles: boxes, prisms, solids of revolution. Every add...() of a solid adds a closed
// surface, wound counter-clockwise as seen from outside. Lengths in metres, Y up.
//
// Coordinates use only + - * / and sqrt, so that the bytes are equal everywhere.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "assets/palette.hpp"

namespace enfilade::assets {

using collision::Vec3;
using Vec2 = Eigen::Vector2d;

/// Triangles grouped by paint, with one normal a vertex.
struct PaintedMesh {
  struct Part {
    Paint paint;
    std::vector<Vec3> positions;
    std::vector<Vec3> normals;
    std::vector<std::uint32_t> indices;
  };
  std::vector<Part> parts;  ///< one a paint, in order of first use
};

/// The paints of a box's six faces.
struct BoxPaints {
  Paint minusX, plusX, minusY, plusY, minusZ, plusZ;
};
inline BoxPaints paintAllFaces(Paint paint) {
  return {paint, paint, paint, paint, paint, paint};
}

/// Frame of a swept profile: u x v = w, all of unit length.
struct SweepFrame {
  Vec3 origin, u, v, w;
};

/// A point of the outline of a solid of revolution.
struct Ring {
  double radius, y;
};

Eigen::Affine3d makeTranslation(const Vec3& by);
/// A rotation about +Y by quarter turns (1 takes +X to -Z), then a translation.
Eigen::Affine3d makeQuarterTurn(int quarters, const Vec3& by = Vec3::Zero());
/// A rotation about +Y by the angle whose half has this tangent, then a translation.
Eigen::Affine3d makeHalfTangentTurn(double tangent, const Vec3& by = Vec3::Zero());

/// Vertices of the regular polygon in the unit circle, counter-clockwise from (1, 0). `sides` is 4
/// or 6 times a power of two.
std::vector<Vec2> makeUnitCircle(int sides);

void addTriangle(PaintedMesh& shape, const Vec3& a, const Vec3& b, const Vec3& c, Paint paint);
void addQuad(PaintedMesh& shape, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d,
             Paint paint);

void addBox(PaintedMesh& shape, const Vec3& low, const Vec3& high, const BoxPaints& paints);
void addBox(PaintedMesh& shape, const Vec3& low, const Vec3& high, Paint paint);
/// A box whose top is a grid of cells; `tone` gives the paint of a cell.
void addTiledSlab(PaintedMesh& shape, const Vec3& low, const Vec3& high, int cellsX, int cellsZ,
                  Paint side, const std::vector<Paint>& cellTones);
/// A simple polygon in (u, v), counter-clockwise, swept along w.
void addPrism(PaintedMesh& shape, const std::vector<Vec2>& profile, const SweepFrame& frame,
              double length, Paint paint);
/// The face of a simple polygon alone, seen from +w.
void addPolygon(PaintedMesh& shape, const std::vector<Vec2>& profile, const SweepFrame& frame,
                Paint paint);
/// Revolves an outline from bottom to top about the vertical through `base`. Closed at both ends.
void addTurned(PaintedMesh& shape, const Vec3& base, const std::vector<Ring>& outline, int sides,
               Paint paint);
void addCylinder(PaintedMesh& shape, const Vec3& base, double radius, double height, int sides,
                 Paint paint);
/// A round rod from a to b.
void addRod(PaintedMesh& shape, const Vec3& a, const Vec3& b, double radius, int sides,
            Paint paint);
void addBall(PaintedMesh& shape, const Vec3& centre, const Vec3& radii, int sides, Paint paint);
/// A torus about the vertical.
void addTorus(PaintedMesh& shape, const Vec3& centre, double ringRadius, double tubeRadius,
              int sides, int tubeSides, Paint paint);
/// A straight bar of constant section with vertical ends. a, b are the centres of its ends, which
/// differ along one horizontal axis and in height (handrails, stringers).
void addSlopedBar(PaintedMesh& shape, const Vec3& a, const Vec3& b, double width, double height,
                  Paint paint);

void append(PaintedMesh& shape, const PaintedMesh& other, const Eigen::Affine3d& shapeFromOther);

}  // namespace enfilade::assets
