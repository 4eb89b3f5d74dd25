#include "assets/painted_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace enfilade::assets {
namespace {

PaintedMesh::Part& findOrAddPart(PaintedMesh& shape, Paint paint) {
  for (PaintedMesh::Part& part : shape.parts)
    if (part.paint == paint) return part;
  shape.parts.push_back({paint, {}, {}, {}});
  return shape.parts.back();
}

std::uint32_t addVertex(PaintedMesh::Part& part, const Vec3& position, const Vec3& normal) {
  part.positions.push_back(position);
  part.normals.push_back(normal);
  return static_cast<std::uint32_t>(part.positions.size() - 1);
}

double computeCross(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

bool isInsideOrOn(const Vec2& p, const Vec2& a, const Vec2& b, const Vec2& c) {
  return computeCross(a, b, p) >= 0 && computeCross(b, c, p) >= 0 && computeCross(c, a, p) >= 0;
}

/// Whether the corner at `i` is an ear of the polygon of the remaining indices.
bool isEar(const std::vector<Vec2>& polygon, const std::vector<std::uint32_t>& left,
           std::size_t i) {
  const std::size_t n = left.size();
  const std::uint32_t ia = left[(i + n - 1) % n], ib = left[i], ic = left[(i + 1) % n];
  if (computeCross(polygon[ia], polygon[ib], polygon[ic]) <= 0) return false;
  return std::none_of(left.begin(), left.end(), [&](std::uint32_t k) {
    return k != ia && k != ib && k != ic &&
           isInsideOrOn(polygon[k], polygon[ia], polygon[ib], polygon[ic]);
  });
}

/// Triangulates by ear clipping; three indices a triangle.
std::vector<std::uint32_t> triangulatePolygon(const std::vector<Vec2>& polygon) {
  std::vector<std::uint32_t> left(polygon.size()), triangles;
  for (std::uint32_t i = 0; i < left.size(); ++i) left[i] = i;
  while (left.size() >= 3) {
    const std::size_t n = left.size();
    std::size_t ear = 0;
    while (ear < n && !isEar(polygon, left, ear)) ++ear;
    if (ear == n) throw std::logic_error("assets: a profile is not a simple polygon");
    triangles.insert(triangles.end(), {left[(ear + n - 1) % n], left[ear], left[(ear + 1) % n]});
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(ear));
  }
  return triangles;
}

Vec3 computePoint(const SweepFrame& f, const Vec2& p, double along) {
  return f.origin + p.x() * f.u + p.y() * f.v + along * f.w;
}

/// The outward normal of an outline's segment, in (radius, y).
Vec2 computeSegmentNormal(const Ring& a, const Ring& b) {
  const Vec2 n{b.y - a.y, a.radius - b.radius};
  return n / std::sqrt(n.x() * n.x() + n.y() * n.y());
}

/// Smooths over bends of less than about 45 degrees.
Vec2 computeJointNormal(const Vec2& own, const Vec2& neighbour) {
  if (own.dot(neighbour) < 0.7) return own;
  const Vec2 sum = own + neighbour;
  return sum / std::sqrt(sum.x() * sum.x() + sum.y() * sum.y());
}

void addBand(PaintedMesh::Part& part, const Vec3& base, const std::vector<Vec2>& circle,
             const Ring& low, const Ring& high, const Vec2& lowNormal, const Vec2& highNormal) {
  const auto n = static_cast<std::uint32_t>(circle.size());
  const auto first = static_cast<std::uint32_t>(part.positions.size());
  for (const Vec2& c : circle) {
    const Vec3 out{c.x(), 0, -c.y()};
    addVertex(part, base + low.radius * out + Vec3{0, low.y, 0},
              lowNormal.x() * out + Vec3{0, lowNormal.y(), 0});
    addVertex(part, base + high.radius * out + Vec3{0, high.y, 0},
              highNormal.x() * out + Vec3{0, highNormal.y(), 0});
  }
  for (std::uint32_t i = 0; i < n; ++i) {
    const std::uint32_t a = first + 2 * i, b = first + 2 * ((i + 1) % n);
    if (low.radius > 0) part.indices.insert(part.indices.end(), {a, b, b + 1});
    if (high.radius > 0) part.indices.insert(part.indices.end(), {a, b + 1, a + 1});
  }
}

void addDisc(PaintedMesh& shape, const Vec3& base, const std::vector<Vec2>& circle,
             const Ring& ring, bool facesUp, Paint paint) {
  if (ring.radius <= 0) return;
  PaintedMesh::Part& part = findOrAddPart(shape, paint);
  const auto first = static_cast<std::uint32_t>(part.positions.size());
  const Vec3 normal{0, facesUp ? 1.0 : -1.0, 0};
  for (const Vec2& c : circle)
    addVertex(part, base + Vec3{ring.radius * c.x(), ring.y, -ring.radius * c.y()}, normal);
  for (std::uint32_t i = 1; i + 1 < circle.size(); ++i) {
    const std::uint32_t b = first + (facesUp ? i : i + 1), c = first + (facesUp ? i + 1 : i);
    part.indices.insert(part.indices.end(), {first, b, c});
  }
}

}  // namespace

Eigen::Affine3d makeTranslation(const Vec3& by) {
  return makeQuarterTurn(0, by);
}

Eigen::Affine3d makeQuarterTurn(int quarters, const Vec3& by) {
  constexpr double kCosine[] = {1, 0, -1, 0}, kSine[] = {0, 1, 0, -1};
  const double c = kCosine[quarters & 3], s = kSine[quarters & 3];
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() << c, 0, s, 0, 1, 0, -s, 0, c;
  result.translation() = by;
  return result;
}

Eigen::Affine3d makeHalfTangentTurn(double t, const Vec3& by) {
  const double c = (1 - t * t) / (1 + t * t), s = 2 * t / (1 + t * t);
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() << c, 0, s, 0, 1, 0, -s, 0, c;
  result.translation() = by;
  return result;
}

std::vector<Vec2> makeUnitCircle(int sides) {
  std::vector<Vec2> corners;
  const double h = std::sqrt(3.0) / 2;
  if (sides % 6 == 0)
    corners = {{1, 0}, {0.5, h}, {-0.5, h}, {-1, 0}, {-0.5, -h}, {0.5, -h}};
  else
    corners = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  while (corners.size() < static_cast<std::size_t>(sides)) {
    std::vector<Vec2> finer;
    for (std::size_t i = 0; i < corners.size(); ++i) {
      const Vec2 middle = corners[i] + corners[(i + 1) % corners.size()];
      finer.push_back(corners[i]);
      finer.push_back(middle / std::sqrt(middle.x() * middle.x() + middle.y() * middle.y()));
    }
    corners = finer;
  }
  return corners;
}

void addTriangle(PaintedMesh& shape, const Vec3& a, const Vec3& b, const Vec3& c, Paint paint) {
  PaintedMesh::Part& part = findOrAddPart(shape, paint);
  Vec3 n = (b - a).cross(c - a);
  n /= std::sqrt(n.x() * n.x() + n.y() * n.y() + n.z() * n.z());
  const std::uint32_t ia = addVertex(part, a, n);
  const std::uint32_t ib = addVertex(part, b, n);
  const std::uint32_t ic = addVertex(part, c, n);
  part.indices.insert(part.indices.end(), {ia, ib, ic});
}

void addQuad(PaintedMesh& shape, const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d,
             Paint paint) {
  PaintedMesh::Part& part = findOrAddPart(shape, paint);
  Vec3 n = (c - a).cross(d - b);
  n /= std::sqrt(n.x() * n.x() + n.y() * n.y() + n.z() * n.z());
  const std::uint32_t first = addVertex(part, a, n);
  addVertex(part, b, n);
  addVertex(part, c, n);
  addVertex(part, d, n);
  part.indices.insert(part.indices.end(),
                      {first, first + 1, first + 2, first, first + 2, first + 3});
}

void addBox(PaintedMesh& shape, const Vec3& l, const Vec3& h, const BoxPaints& p) {
  const auto getCorner = [&](int i) {
    return Vec3{i & 1 ? h.x() : l.x(), i & 2 ? h.y() : l.y(), i & 4 ? h.z() : l.z()};
  };
  addQuad(shape, getCorner(0), getCorner(4), getCorner(6), getCorner(2), p.minusX);
  addQuad(shape, getCorner(1), getCorner(3), getCorner(7), getCorner(5), p.plusX);
  addQuad(shape, getCorner(0), getCorner(1), getCorner(5), getCorner(4), p.minusY);
  addQuad(shape, getCorner(2), getCorner(6), getCorner(7), getCorner(3), p.plusY);
  addQuad(shape, getCorner(0), getCorner(2), getCorner(3), getCorner(1), p.minusZ);
  addQuad(shape, getCorner(4), getCorner(5), getCorner(7), getCorner(6), p.plusZ);
}

void addBox(PaintedMesh& shape, const Vec3& low, const Vec3& high, Paint paint) {
  addBox(shape, low, high, paintAllFaces(paint));
}

void addTiledSlab(PaintedMesh& shape, const Vec3& l, const Vec3& h, int cellsX, int cellsZ,
                  Paint side, const std::vector<Paint>& cellTones) {
  const auto computeX = [&](int i) {
    return i == cellsX ? h.x() : l.x() + (h.x() - l.x()) * i / cellsX;
  };
  const auto computeZ = [&](int k) {
    return k == cellsZ ? h.z() : l.z() + (h.z() - l.z()) * k / cellsZ;
  };
  const double y0 = l.y(), y1 = h.y();
  for (int i = 0; i < cellsX; ++i) {
    const double a = computeX(i), b = computeX(i + 1);
    for (int k = 0; k < cellsZ; ++k) {
      const double c = computeZ(k), d = computeZ(k + 1);
      const Paint tone = cellTones[static_cast<std::size_t>(i * cellsZ + k) % cellTones.size()];
      addQuad(shape, {a, y1, c}, {a, y1, d}, {b, y1, d}, {b, y1, c}, tone);
      addQuad(shape, {a, y0, c}, {b, y0, c}, {b, y0, d}, {a, y0, d}, side);
    }
    addQuad(shape, {a, y0, h.z()}, {b, y0, h.z()}, {b, y1, h.z()}, {a, y1, h.z()}, side);
    addQuad(shape, {a, y0, l.z()}, {a, y1, l.z()}, {b, y1, l.z()}, {b, y0, l.z()}, side);
  }
  for (int k = 0; k < cellsZ; ++k) {
    const double c = computeZ(k), d = computeZ(k + 1);
    addQuad(shape, {l.x(), y0, c}, {l.x(), y0, d}, {l.x(), y1, d}, {l.x(), y1, c}, side);
    addQuad(shape, {h.x(), y0, c}, {h.x(), y1, c}, {h.x(), y1, d}, {h.x(), y0, d}, side);
  }
}

void addPolygon(PaintedMesh& shape, const std::vector<Vec2>& profile, const SweepFrame& frame,
                Paint paint) {
  PaintedMesh::Part& part = findOrAddPart(shape, paint);
  const auto first = static_cast<std::uint32_t>(part.positions.size());
  for (const Vec2& p : profile) addVertex(part, computePoint(frame, p, 0), frame.w);
  for (std::uint32_t i : triangulatePolygon(profile)) part.indices.push_back(first + i);
}

void addPrism(PaintedMesh& shape, const std::vector<Vec2>& profile, const SweepFrame& f,
              double length, Paint paint) {
  const std::size_t n = profile.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Vec2 &a = profile[i], &b = profile[(i + 1) % n];
    addQuad(shape, computePoint(f, a, 0), computePoint(f, b, 0), computePoint(f, b, length),
            computePoint(f, a, length), paint);
  }
  PaintedMesh::Part& part = findOrAddPart(shape, paint);
  const std::vector<std::uint32_t> triangles = triangulatePolygon(profile);
  for (const bool top : {false, true}) {
    const auto first = static_cast<std::uint32_t>(part.positions.size());
    for (const Vec2& p : profile)
      addVertex(part, computePoint(f, p, top ? length : 0), top ? f.w : Vec3{-f.w});
    for (std::size_t i = 0; i < triangles.size(); i += 3)
      part.indices.insert(part.indices.end(),
                          {first + triangles[i], first + triangles[top ? i + 1 : i + 2],
                           first + triangles[top ? i + 2 : i + 1]});
  }
}

void addTurned(PaintedMesh& shape, const Vec3& base, const std::vector<Ring>& outline, int sides,
               Paint paint) {
  const std::vector<Vec2> circle = makeUnitCircle(sides);
  std::vector<Vec2> normals;
  for (std::size_t i = 0; i + 1 < outline.size(); ++i)
    normals.push_back(computeSegmentNormal(outline[i], outline[i + 1]));
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Vec2 low = i > 0 ? computeJointNormal(normals[i], normals[i - 1]) : normals[i];
    const Vec2 high =
        i + 1 < normals.size() ? computeJointNormal(normals[i], normals[i + 1]) : normals[i];
    addBand(findOrAddPart(shape, paint), base, circle, outline[i], outline[i + 1], low, high);
  }
  addDisc(shape, base, circle, outline.front(), false, paint);
  addDisc(shape, base, circle, outline.back(), true, paint);
}

void addCylinder(PaintedMesh& shape, const Vec3& base, double radius, double height, int sides,
                 Paint paint) {
  addTurned(shape, base, {{radius, 0}, {radius, height}}, sides, paint);
}

void addRod(PaintedMesh& shape, const Vec3& a, const Vec3& b, double radius, int sides,
            Paint paint) {
  const Vec3 along = b - a;
  const double length = std::sqrt(along.dot(along));
  const Vec3 y = along / length;
  const Vec3 side = y.y() * y.y() > 0.5 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  Vec3 z = side.cross(y);
  z /= std::sqrt(z.dot(z));
  Eigen::Affine3d frame = Eigen::Affine3d::Identity();
  frame.linear() << y.cross(z), y, z;
  frame.translation() = a;
  PaintedMesh rod;
  addCylinder(rod, Vec3::Zero(), radius, length, sides, paint);
  append(shape, rod, frame);
}

void addBall(PaintedMesh& shape, const Vec3& centre, const Vec3& radii, int sides, Paint paint) {
  const std::vector<Vec2> circle = makeUnitCircle(2 * (sides / 2));
  std::vector<Ring> outline;  // the right half of the circle, from the lowest point up
  const int half = sides / 2, quarter = sides / 4;
  for (int i = 0; i <= half; ++i) {
    const Vec2& c = circle[static_cast<std::size_t>((i + sides - quarter) % sides)];
    outline.push_back({i == 0 || i == half ? 0.0 : c.x(), c.y()});
  }
  PaintedMesh ball;
  addTurned(ball, Vec3::Zero(), outline, sides, paint);
  Eigen::Affine3d stretch = Eigen::Affine3d::Identity();
  stretch.linear() = radii.asDiagonal();
  stretch.translation() = centre;
  append(shape, ball, stretch);
}

void addTorus(PaintedMesh& shape, const Vec3& centre, double ringRadius, double tubeRadius,
              int sides, int tubeSides, Paint paint) {
  const std::vector<Vec2> tube = makeUnitCircle(tubeSides), circle = makeUnitCircle(sides);
  for (std::size_t i = 0; i < tube.size(); ++i) {
    const Vec2 &a = tube[i], &b = tube[(i + 1) % tube.size()];
    addBand(findOrAddPart(shape, paint), centre, circle,
            {ringRadius + tubeRadius * a.x(), tubeRadius * a.y()},
            {ringRadius + tubeRadius * b.x(), tubeRadius * b.y()}, a, b);
  }
}

void addSlopedBar(PaintedMesh& shape, const Vec3& a, const Vec3& b, double width, double height,
                  Paint paint) {
  const bool alongX = a.z() == b.z();
  const double run = alongX ? b.x() - a.x() : b.z() - a.z();
  const double rise = b.y() - a.y(), h = height / 2;
  std::vector<Vec2> profile{{0, -h}, {run, rise - h}, {run, rise + h}, {0, h}};
  if (run < 0) std::reverse(profile.begin(), profile.end());
  const Vec3 u = alongX ? Vec3{1, 0, 0} : Vec3{0, 0, 1};
  const Vec3 w = alongX ? Vec3{0, 0, 1} : Vec3{-1, 0, 0};
  addPrism(shape, profile, {a - 0.5 * width * w, u, Vec3{0, 1, 0}, w}, width, paint);
}

void append(PaintedMesh& shape, const PaintedMesh& other, const Eigen::Affine3d& shapeFromOther) {
  const Eigen::Matrix3d normalMatrix = shapeFromOther.linear().inverse().transpose();
  for (const PaintedMesh::Part& from : other.parts) {
    PaintedMesh::Part& to = findOrAddPart(shape, from.paint);
    const auto first = static_cast<std::uint32_t>(to.positions.size());
    for (std::size_t i = 0; i < from.positions.size(); ++i) {
      const Vec3 n = normalMatrix * from.normals[i];
      addVertex(to, shapeFromOther * from.positions[i], n / std::sqrt(n.dot(n)));
    }
    for (std::uint32_t i : from.indices) to.indices.push_back(first + i);
  }
}

}  // namespace enfilade::assets
