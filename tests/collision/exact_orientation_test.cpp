// Compares determinant signs with rationals: near zero, zero, huge, tiny and mixed values.
#include "collision/shapes/exact_orientation.hpp"

#include <gmpxx.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace enfilade::collision {
namespace {

int computeRationalTurn(const Vec3& a, const Vec3& b, const Vec3& c, int dropped) {
  const int i = (dropped + 1) % 3, j = (dropped + 2) % 3;
  const mpq_class ux = mpq_class(b[i]) - a[i], uy = mpq_class(b[j]) - a[j];
  const mpq_class vx = mpq_class(c[i]) - a[i], vy = mpq_class(c[j]) - a[j];
  return sgn(ux * vy - uy * vx);
}

int computeRationalOrientation(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) {
  const auto minus = [](const Vec3& p, const Vec3& q) {
    return std::array<mpq_class, 3>{mpq_class(p.x()) - q.x(), mpq_class(p.y()) - q.y(),
                                    mpq_class(p.z()) - q.z()};
  };
  const auto u = minus(b, a), v = minus(c, a), w = minus(d, a);
  return sgn(w[0] * (u[1] * v[2] - u[2] * v[1]) + w[1] * (u[2] * v[0] - u[0] * v[2]) +
             w[2] * (u[0] * v[1] - u[1] * v[0]));
}

/// Realistic and unrealistic coordinates: integers, floats, doubles, of mixed size.
struct CoordinateGenerator {
  std::mt19937_64 random{11};
  double drawCoordinate(int kind) {
    const auto whole = static_cast<double>(static_cast<int>(random() % 7) - 3);
    const double unit = static_cast<double>(random() >> 11) * 0x1p-53;
    switch (kind) {
      case 0:
        return whole;
      case 1:
        return static_cast<double>(static_cast<float>(whole + 1e-3 * unit));
      case 2:
        return whole + unit * 0x1p-40;
      case 3:
        return whole * std::ldexp(1.0, static_cast<int>(random() % 2000) - 1050);
      default:
        return random() % 2 == 0 ? whole * 1e80 : whole * 1e-300;
    }
  }
  Vec3 drawPoint(int kind) {
    const double x = drawCoordinate(kind), y = drawCoordinate(kind), z = drawCoordinate(kind);
    return {x, y, z};
  }
};

TEST(ExactOrientation, SignsAreThoseOfRationals) {
  CoordinateGenerator coordinates;
  std::array<int, 3> turns{}, orientations{};
  for (int i = 0; i < 20000; ++i) {
    const int kind = i % 5;
    const Vec3 a = coordinates.drawPoint(kind), b = coordinates.drawPoint(kind);
    // Half of the points lie on the line through the first two, up to rounding.
    const Vec3 c = i % 2 ? coordinates.drawPoint(kind) : Vec3(a + 2 * (b - a));
    const Vec3 d = coordinates.drawPoint(kind);
    for (int dropped = 0; dropped < 3; ++dropped) {
      const int sign = orient2d(a, b, c, dropped);
      ASSERT_EQ(sign, computeRationalTurn(a, b, c, dropped))
          << a.transpose() << " | " << b.transpose() << " | " << c.transpose();
      ++turns.at(static_cast<std::size_t>(sign + 1));
    }
    const int sign = orient3d(a, b, c, d);
    ASSERT_EQ(sign, computeRationalOrientation(a, b, c, d))
        << a.transpose() << " | " << b.transpose() << " | " << c.transpose();
    ++orientations.at(static_cast<std::size_t>(sign + 1));
  }
  for (const int count : turns) EXPECT_GT(count, 2000);
  for (const int count : orientations) EXPECT_GT(count, 2000);
}

TEST(ExactOrientation, CornersOfATurnedFlatFaceLieWhereRationalsHaveThem) {
  CoordinateGenerator coordinates;
  std::array<int, 3> orientations{};
  for (int i = 0; i < 5000; ++i) {
    const Mat3 rotation =
        Eigen::AngleAxisd(coordinates.drawCoordinate(2), Vec3(1, 2, 3).normalized())
            .toRotationMatrix();
    const Vec3 middle = coordinates.drawPoint(2);
    const auto corner = [&]() -> Vec3 {
      return rotation * Vec3(coordinates.drawCoordinate(2), coordinates.drawCoordinate(2), 0) +
             middle;
    };
    const Vec3 a = corner(), b = corner(), c = corner(), d = corner();
    const int sign = orient3d(a, b, c, d);
    ASSERT_EQ(sign, computeRationalOrientation(a, b, c, d)) << i;
    ++orientations.at(static_cast<std::size_t>(sign + 1));
    for (int dropped = 0; dropped < 3; ++dropped) {
      const Vec3 along = a + coordinates.drawCoordinate(0) * (b - a);
      ASSERT_EQ(orient2d(a, b, along, dropped), computeRationalTurn(a, b, along, dropped)) << i;
    }
  }
  EXPECT_GT(orientations[0], 1000);
  EXPECT_GT(orientations[2], 1000);
}

TEST(ExactOrientation, LargeIntegersWithDeterminantOneOrZeroAreDecided) {
  std::mt19937_64 random{12};
  for (int i = 0; i < 3000; ++i) {
    const int determinant = i % 3 - 1;
    Mat3 rows = Vec3(1, 1, determinant).asDiagonal();
    for (int k = 0; k < 6; ++k) {  // adding a multiple of one row to another does not change it
      const auto from = static_cast<Eigen::Index>(random() % 3);
      const auto to = (from + 1 + static_cast<Eigen::Index>(random() % 2)) % 3;
      const auto times = static_cast<double>(static_cast<int>(random() % 512) - 256);
      rows.row(to) += times * rows.row(from);
    }
    ASSERT_LT(rows.cwiseAbs().maxCoeff(), 0x1p53) << "not an exact integer";
    ASSERT_EQ(orient3d(Vec3::Zero(), rows.row(0), rows.row(1), rows.row(2)), determinant) << rows;
  }
}

}  // namespace
}  // namespace enfilade::collision
