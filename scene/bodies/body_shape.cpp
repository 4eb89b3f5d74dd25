// Steps
//  1. The triangles of the body's objects are welded by exact position and split into connected
//     pieces.
//  2. A piece that is closed and encloses what its hull encloses becomes that hull: convex but for
//     the rounding of its coordinates. Others stay triangles in kinematic bodies, and become their
//     hull in rigid bodies and triggers, which is counted.
//  3. Mass: each hull is cut into tetrahedra from one point, their covariances are summed (Blow and
//     Binstock 2004, "How to find the inertia tensor").
#include "scene/bodies/body_shape.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <stdexcept>

#include "scene/scene.hpp"

namespace enfilade::scene {
namespace {

using collision::Hull;
using collision::Mat3;
using collision::Triangle;

constexpr double kSameVolume = 1e-6;  // of the hull's: float coordinates round to 6e-8
constexpr double kLeastThick = 1e-3;  // metres: sheets have mass as if they were so thick

using Key = std::array<double, 3>;

Key keyOf(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

/// Triangles that hang together by shared corners.
using Piece = std::vector<Triangle>;

class Welder {
 public:
  explicit Welder(const std::vector<Triangle>& triangles) {
    for (const Triangle& t : triangles) {
      const std::uint32_t first = corner(t[0]);
      join(first, corner(t[1]));
      join(first, corner(t[2]));
    }
    std::map<std::uint32_t, std::size_t> pieceOfRoot;  // pieces in order of their first triangle
    for (const Triangle& t : triangles) {
      const auto [at, isNew] = pieceOfRoot.try_emplace(rootOf(corner(t[0])), pieces_.size());
      if (isNew) pieces_.emplace_back();
      pieces_[at->second].push_back(t);
    }
  }
  const std::vector<Piece>& pieces() const { return pieces_; }

 private:
  std::uint32_t corner(const Vec3& v) {
    const auto [at, isNew] =
        corners_.try_emplace(keyOf(v), static_cast<std::uint32_t>(parent_.size()));
    if (isNew) parent_.push_back(at->second);
    return at->second;
  }
  std::uint32_t rootOf(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) { parent_[rootOf(b)] = rootOf(a); }

  std::map<Key, std::uint32_t> corners_;
  std::vector<std::uint32_t> parent_;
  std::vector<Piece> pieces_;
};

/// Every directed edge has its opposite, as often.
bool isClosed(const Piece& piece) {
  std::vector<std::pair<Key, Key>> forth, back;
  for (const Triangle& t : piece) {
    for (std::size_t i = 0; i < 3; ++i) {
      forth.emplace_back(keyOf(t[i]), keyOf(t[(i + 1) % 3]));
      back.emplace_back(keyOf(t[(i + 1) % 3]), keyOf(t[i]));
    }
  }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  return forth == back;
}

/// Six times the signed volume of the tetrahedron from the origin.
double sixVolumes(const Vec3& a, const Vec3& b, const Vec3& c) {
  return a.dot(b.cross(c));
}

double volumeOf(const Piece& piece) {
  const Vec3 from = piece.front()[0];
  double sum = 0;
  for (const Triangle& t : piece) sum += sixVolumes(t[0] - from, t[1] - from, t[2] - from);
  return std::abs(sum) / 6;
}

/// What a solid of density 1 is: volume, first and second moments about the origin.
struct Moments {
  double volume = 0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  void add(const Vec3& from, const Vec3& a, const Vec3& b, const Vec3& c) {
    const double v = sixVolumes(a - from, b - from, c - from) / 6;
    const Vec3 sum = from + a + b + c;
    volume += v;
    first += v / 4 * sum;
    second += v / 20 *
              (sum * sum.transpose() + from * from.transpose() + a * a.transpose() +
               b * b.transpose() + c * c.transpose());
  }
};

void addHull(Moments& moments, const Hull& hull) {
  if (hull.faces.size() < 4) return;  // flat
  const Vec3& from = hull.vertices[0];
  for (const auto& face : hull.faces)
    for (std::size_t i = 1; i + 1 < face.size(); ++i)
      moments.add(from, hull.vertices[face[0]], hull.vertices[face[i]], hull.vertices[face[i + 1]]);
}

double volumeOf(const Hull& hull) {
  Moments moments;
  addHull(moments, hull);
  return moments.volume;
}

void addTriangles(const Piece& piece, BodyShape& shape) {
  for (const Triangle& t : piece) shape.parts.push_back(collision::buildHull(t));
}

void addPiece(const Piece& piece, bool keepsHollows, BodyShape& shape) {
  std::vector<Vec3> points;
  for (const Triangle& t : piece) points.insert(points.end(), t.begin(), t.end());
  Hull hull = collision::buildHull(points);
  const double volume = volumeOf(hull);
  const bool filled = isClosed(piece) && std::abs(volume - volumeOf(piece)) <= kSameVolume * volume;
  const bool exact = filled || piece.size() == 1;
  if (!exact && keepsHollows) return addTriangles(piece, shape);
  if (!exact) ++shape.approximate;
  ++shape.hulls;
  shape.parts.push_back(std::move(hull));
}

/// A solid box, for bodies whose parts are all flat.
Moments boxMoments(const Box& box) {
  const Vec3 size = box.size().cwiseMax(kLeastThick);
  Moments moments;
  moments.volume = size.prod();
  moments.first = moments.volume * box.centre();
  moments.second = moments.volume * box.centre() * box.centre().transpose();
  for (int i = 0; i < 3; ++i) moments.second(i, i) += moments.volume * size[i] * size[i] / 12;
  return moments;
}

/// Moves the frame's origin to the centre of mass, and says how the mass lies about it.
void weigh(const BodySpec& spec, BodyShape& shape) {
  Moments moments;
  for (const Hull& hull : shape.parts) addHull(moments, hull);
  if (!(moments.volume > kLeastThick * kLeastThick * kLeastThick)) moments = boxMoments(shape.box);
  shape.volume = moments.volume;
  shape.mass = spec.mass.value_or(spec.density * shape.volume);
  const Vec3 centre = moments.first / moments.volume;
  const Mat3 about = moments.second - moments.volume * centre * centre.transpose();
  shape.inertia = shape.mass / shape.volume * (about.trace() * Mat3::Identity() - about);
  shape.origin += centre;
  for (Hull& hull : shape.parts)
    for (Vec3& vertex : hull.vertices) vertex -= centre;
}

void measure(BodyShape& shape) {
  shape.box = {};
  shape.radius = 0;
  for (Hull& hull : shape.parts) {
    hull.radius = 0;
    for (const Vec3& vertex : hull.vertices) {
      shape.box.include(vertex);
      hull.radius = std::max(hull.radius, vertex.norm());
    }
    shape.radius = std::max(shape.radius, hull.radius);
  }
  shape.radius *= 1 + 0x1p-48;
}

}  // namespace

BodyShape shapeOf(const Model& model, const BodySpec& spec) {
  std::vector<Triangle> triangles;
  for (const std::uint32_t object : spec.objects) {
    if (model.objects[object].use == Object::Use::drawn) continue;
    for (const Triangle& t : solidTriangles(model, object)) triangles.push_back(t);
  }
  if (triangles.empty())
    throw std::invalid_argument("body '" + spec.name + "': its objects have no triangles; '" +
                                model.objects[spec.objects[0]].path + "' is the first of them");
  BodyShape shape;
  shape.origin = spec.anchor;
  if (spec.kind == BodyKind::rigid) {
    Box box;
    for (const Triangle& t : triangles) box.include(collision::boxOf(t));
    shape.origin = box.centre();  // near by, until the centre of mass is known
  }
  for (Triangle& t : triangles)
    for (Vec3& corner : t) corner -= shape.origin;
  const Welder welder(triangles);
  for (const Piece& piece : welder.pieces()) addPiece(piece, isKinematic(spec.kind), shape);
  measure(shape);
  if (spec.kind == BodyKind::rigid) {
    weigh(spec, shape);
    measure(shape);
  }
  return shape;
}

}  // namespace enfilade::scene
