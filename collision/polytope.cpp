#include "collision/polytope.hpp"

namespace enfilade::collision {
namespace {

template <class Real>
std::uint16_t addSupport(const Eigen::Matrix<Real, 3, 1>& outward, Polytope<Real>& polytope) {
  VertexPair hint{};
  const WideVec inward = -outward.template cast<Wide>();
  leastAlong(polytope.difference, inward, inward.norm(), hint);
  return polytope.addCorner(hint);
}

/// Two tips and a ring between them, counter-clockwise seen from the upper one.
template <class Real>
bool addBipyramid(std::span<const std::uint16_t> ring, std::uint16_t upper, std::uint16_t lower,
                  Polytope<Real>& polytope) {
  for (std::size_t k = 0; k < ring.size(); ++k) {
    const std::uint16_t from = ring[k], to = ring[(k + 1) % ring.size()];
    if (!polytope.addFacet({from, to, upper}) || !polytope.addFacet({to, from, lower}))
      return false;
  }
  return true;
}

}  // namespace

template <class Real>
bool surround(std::span<const VertexPair> simplex, Polytope<Real>& polytope) {
  using Vec = Eigen::Matrix<Real, 3, 1>;
  for (const VertexPair& pair : simplex) polytope.addCorner(pair);
  const auto& p = polytope.points;
  if (simplex.size() == 4) {
    const bool turned = (p[1] - p[0]).dot((p[2] - p[0]).cross(p[3] - p[0])) < 0;
    const std::uint16_t second = turned ? 2 : 1, third = turned ? 1 : 2;
    return polytope.addFacet({0, third, second}) && polytope.addFacet({0, second, 3}) &&
           polytope.addFacet({0, 3, third}) && polytope.addFacet({second, third, 3});
  }
  if (simplex.size() == 3) {
    const Vec normal = (p[1] - p[0]).cross(p[2] - p[0]);
    const std::array<std::uint16_t, 3> ring{0, 1, 2};
    const std::uint16_t upper = addSupport<Real>(normal, polytope);
    return addBipyramid<Real>(ring, upper, addSupport<Real>(-normal, polytope), polytope);
  }
  if (simplex.size() == 2) {
    const Vec along = p[1] - p[0];
    const Vec side = along.unitOrthogonal() * along.norm();
    const Vec other = along.cross(side) / along.norm() * Real(0.8660254037844386);
    std::array<std::uint16_t, 3> ring{};
    ring[0] = addSupport<Real>(side, polytope);
    ring[1] = addSupport<Real>(other - side / 2, polytope);
    ring[2] = addSupport<Real>(-other - side / 2, polytope);
    return addBipyramid<Real>(ring, 1, 0, polytope);
  }
  return surroundByAxes(polytope);
}

template <class Real>
bool surroundByAxes(Polytope<Real>& polytope) {
  using Vec = Eigen::Matrix<Real, 3, 1>;
  std::array<std::uint16_t, 6> tips{};
  for (int k = 0; k < 6; ++k)
    tips[k] =
        addSupport<Real>(k % 2 == 0 ? Vec(Vec::Unit(k / 2)) : Vec(-Vec::Unit(k / 2)), polytope);
  const std::array<std::uint16_t, 4> ring{tips[0], tips[2], tips[1], tips[3]};
  return addBipyramid<Real>(ring, tips[4], tips[5], polytope);
}

template bool surround(std::span<const VertexPair>, Polytope<double>&);
template bool surround(std::span<const VertexPair>, Polytope<Wide>&);
template bool surroundByAxes(Polytope<double>&);
template bool surroundByAxes(Polytope<Wide>&);

}  // namespace enfilade::collision
