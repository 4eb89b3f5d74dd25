// The shapes are smooth surfaces (tubes, cushions, leaves, rough sheets), tessellated as finely as
// the number of triangles allows. Lengths are metres, y is up.
#include "tests/support/dense_scenes.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/scene/thin_geometry.hpp"

namespace enfilade::tests {
namespace {

using scene::Mesh;
using scene::Model;
using scene::Vec3;
using Random = scene::testing::Seeded;
using Surface = std::function<Vec3(double u, double v)>;  ///< u and v in 0..1

constexpr double kTurn = 2 * std::numbers::pi;

/// A parametric surface of 2 * rows * columns triangles, without the cells that `isHole` names.
void addSurface(Mesh& mesh, int rows, int columns, const Surface& pointAt,
                const std::function<bool(int row, int column)>& isHole = {}) {
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i <= rows; ++i)
    for (int k = 0; k <= columns; ++k)
      mesh.positions.push_back(pointAt(double(i) / rows, double(k) / columns).cast<float>());
  const auto stride = static_cast<std::uint32_t>(columns) + 1;
  for (int i = 0; i < rows; ++i) {
    for (int k = 0; k < columns; ++k) {
      if (isHole && isHole(i, k)) continue;
      const std::uint32_t at =
          first + static_cast<std::uint32_t>(i) * stride + static_cast<std::uint32_t>(k);
      mesh.indices.insert(mesh.indices.end(),
                          {at, at + 1, at + stride, at + 1, at + stride + 1, at + stride});
    }
  }
}

/// A tube of radius `radius` along a line of points, a closed ring of `sides` at each.
void addTube(Mesh& mesh, const std::vector<Vec3>& line, double radius, int sides) {
  const int rows = static_cast<int>(line.size()) - 1;
  addSurface(mesh, rows, sides, [&](double u, double v) {
    const auto at = static_cast<std::size_t>(std::lround(u * rows));
    const Vec3 along =
        (line[std::min(at + 1, line.size() - 1)] - line[at == 0 ? 0 : at - 1]).normalized();
    const Vec3 side =
        along.cross(std::abs(along.y()) < 0.9 ? Vec3::UnitY() : Vec3::UnitX()).normalized();
    // The last column repeats the first, so that the ring is closed.
    const double angle = v == 1 ? 0 : kTurn * v;
    return Vec3(line[at] + radius * (std::cos(angle) * side + std::sin(angle) * along.cross(side)));
  });
}

/// A rounded slab, as a cushion or a pebble: a superellipsoid.
void addCushion(Mesh& mesh, const Vec3& centre, const Vec3& halfSize, int steps) {
  const auto power = [](double x) { return std::copysign(std::pow(std::abs(x), 0.4), x); };
  addSurface(mesh, steps, 2 * steps, [&](double u, double v) {
    const double up = std::numbers::pi * (u - 0.5), around = v == 1 ? 0 : kTurn * v;
    const double across = power(std::cos(up));
    return Vec3(centre +
                halfSize.cwiseProduct(Vec3(across * power(std::cos(around)), power(std::sin(up)),
                                           across * power(std::sin(around)))));
  });
}

std::vector<Vec3> makeStraightLine(const Vec3& from, const Vec3& to, int steps) {
  std::vector<Vec3> line;
  for (int i = 0; i <= steps; ++i) line.push_back(from + (to - from) * (double(i) / steps));
  return line;
}

/// A cable that sags between two points.
std::vector<Vec3> makeSaggingLine(const Vec3& from, const Vec3& to, double sag, int steps) {
  std::vector<Vec3> line = makeStraightLine(from, to, steps);
  for (int i = 0; i <= steps; ++i)
    line[static_cast<std::size_t>(i)].y() -= sag * std::sin(std::numbers::pi * i / steps);
  return line;
}

/// An office chair: five feet, a column, a seat and a bent back. 40 n^2 triangles and some.
Mesh makeChair(int n) {
  Mesh mesh;
  for (int foot = 0; foot < 5; ++foot) {
    const Vec3 out(std::cos(kTurn * foot / 5), 0, std::sin(kTurn * foot / 5));
    addTube(mesh, makeStraightLine(0.05 * out + Vec3(0, 0.09, 0), 0.3 * out + Vec3(0, 0.05, 0), n),
            0.02, n);
    addCushion(mesh, 0.3 * out + Vec3(0, 0.03, 0), {0.025, 0.03, 0.025}, n / 2);
  }
  addTube(mesh, makeStraightLine({0, 0.08, 0}, {0, 0.44, 0}, n), 0.03, n);
  addCushion(mesh, {0, 0.47, 0}, {0.24, 0.04, 0.24}, n);
  addSurface(mesh, 2 * n, 2 * n, [](double u, double v) {
    const double x = 0.42 * (v - 0.5);
    return Vec3(x, 0.55 + 0.5 * u, -0.24 + 0.8 * x * x - 0.06 * u);
  });
  return mesh;
}

/// A pot with leaves: bent strips around a stem. About 12 n^2 triangles.
Mesh makePlant(int n, Random& random) {
  Mesh mesh;
  addSurface(mesh, n, n, [](double u, double v) {
    const double angle = v == 1 ? 0 : kTurn * v, radius = 0.12 + 0.06 * u;
    return Vec3(radius * std::cos(angle), 0.35 * u, radius * std::sin(angle));
  });
  for (int leaf = 0; leaf < 2 * n; ++leaf) {
    const double around = random.drawUniform(0, kTurn), length = random.drawUniform(0.2, 0.5);
    const double rise = random.drawUniform(0.2, 1.0), width = random.drawUniform(0.02, 0.05);
    const Vec3 out(std::cos(around), 0, std::sin(around)), side(-out.z(), 0, out.x());
    addSurface(mesh, std::max(2, n / 2), 2, [&](double u, double v) {
      const double half = width * std::sin(std::numbers::pi * std::min(u, 0.999));
      return Vec3(u * length * out + Vec3(0, 0.35 + rise * u * (1.3 - 0.7 * u), 0) +
                  (2 * v - 1) * half * side);
    });
  }
  return mesh;
}

void place(Model& model, const std::string& path, std::uint32_t mesh, const Vec3& at, double turn) {
  Eigen::Affine3d transform = Eigen::Affine3d::Identity();
  transform.translate(at);
  transform.rotate(Eigen::AngleAxisd(turn, Vec3::UnitY()));
  model.objects.push_back({path, "", {mesh}, transform});
}

std::uint32_t addMesh(Model& model, Mesh mesh) {
  model.meshes.push_back(std::move(mesh));
  return static_cast<std::uint32_t>(model.meshes.size() - 1);
}

void addRoom(scene::testing::Builder& builder, double width, double depth) {
  builder.addBox("floor", {0, -0.2, 0}, {width, 0, depth});
  builder.addBox("wall west", {-0.2, 0, 0}, {0, 3, depth});
  builder.addBox("wall east", {width, 0, 0}, {width + 0.2, 3, depth});
  builder.addBox("wall north", {0, 0, -0.2}, {width, 3, 0});
  builder.addBox("wall south", {0, 0, depth}, {width, 3, depth + 0.2});
}

/// A room of 10 x 11 m: rows of desks with chairs, plants, and cables on desks and floor.
Model makeOffice(std::size_t triangles) {
  Random random(7);
  scene::testing::Builder builder;
  addRoom(builder, 10, 11);
  constexpr int kRows = 5, kDesks = 4;
  // 20 chairs, 12 plants and 40 cables share the triangles about as 3 : 1 : 1.
  const int chairSteps =
      std::max(4, static_cast<int>(std::sqrt(0.6 * double(triangles) / (20 * 40))));
  const int plantSteps =
      std::max(4, static_cast<int>(std::sqrt(0.2 * double(triangles) / (12 * 12))));
  const int cableSteps = std::max(4, static_cast<int>(0.2 * double(triangles) / (40 * 12)));
  Model& model = builder.model;
  const std::uint32_t chair = addMesh(model, makeChair(chairSteps));
  for (int row = 0; row < kRows; ++row) {
    for (int desk = 0; desk < kDesks; ++desk) {
      const std::string name = std::to_string(row) + "." + std::to_string(desk);
      const Vec3 at(1.2 + 2.1 * desk, 0, 1.0 + 2.1 * row);
      builder.addBox("desk " + name, at + Vec3(0, 0.70, 0), at + Vec3(1.5, 0.74, 0.7));
      builder.addBox("leg " + name, at + Vec3(0.02, 0, 0.3), at + Vec3(0.06, 0.7, 0.4));
      builder.addBox("leg2 " + name, at + Vec3(1.44, 0, 0.3), at + Vec3(1.48, 0.7, 0.4));
      const Vec3 seat(random.drawUniform(0.5, 1.0), 0.0, random.drawUniform(0.95, 1.2));
      place(model, "chair " + name, chair, at + seat, random.drawUniform(0, kTurn));
      for (int cable = 0; cable < 2; ++cable) {
        const Vec3 from = at + Vec3(random.drawUniform(0.1, 1.4), 0.76, 0.35);
        const Vec3 to = at + Vec3(random.drawUniform(0.1, 1.4), 0.01, random.drawUniform(0.2, 1.1));
        Mesh mesh;
        addTube(mesh, makeSaggingLine(from, to, random.drawUniform(-0.1, 0.005), cableSteps), 0.004,
                6);
        builder.add("cable " + name + "." + std::to_string(cable), std::move(mesh));
      }
    }
  }
  for (int i = 0; i < 12; ++i) {
    const std::uint32_t plant = addMesh(model, makePlant(plantSteps, random));
    place(model, "plant " + std::to_string(i), plant,
          {i % 2 == 0 ? 0.5 : 9.5, 0, 0.6 + 1.9 * (i / 2)}, random.drawUniform(0, kTurn));
  }
  return builder.model;
}

/// An open thing of 60 triangles: a vase, a bowl, a folded sheet or a bent strip.
Mesh makeThing(int kind, Random& random) {
  const double size = random.drawUniform(0.03, 0.1), bend = random.drawUniform(0.2, 0.6);
  Mesh mesh;
  addSurface(mesh, 5, 6, [&](double u, double v) {
    const double angle = v == 1 ? 0 : kTurn * v;
    switch (kind % 4) {
      case 0: {
        const double radius = size * (0.5 + bend * std::sin(3 * u));
        return Vec3(radius * std::cos(angle), 2 * size * u, radius * std::sin(angle));
      }
      case 1:
        return Vec3(size * u * std::cos(angle), size * u * u, size * u * std::sin(angle));
      case 2:
        return Vec3(2 * size * (u - 0.5), size * (0.5 + bend * std::sin(9 * u)),
                    2 * size * (v - 0.5));
      default:
        return Vec3(3 * size * (u - 0.5), 0.01 + bend * size * u * u, 0.3 * size * (v - 0.5));
    }
  });
  return mesh;
}

/// A room of 10 x 11 m like the office of a simulator: racks of boards full of small objects, and
/// some on the floor.
Model makeShop(std::size_t triangles) {
  Random random(11);
  scene::testing::Builder builder;
  addRoom(builder, 10, 11);
  constexpr int kRacks = 4, kBoards = 5, kKinds = 24;
  Model& model = builder.model;
  for (int rack = 0; rack < kRacks; ++rack)
    for (int board = 0; board < kBoards; ++board) {
      const Vec3 at(1 + 2.4 * rack, 0.1 + 0.4 * board, 1);
      builder.addBox("board " + std::to_string(rack) + "." + std::to_string(board), at,
                     at + Vec3(0.5, 0.02, 9));
    }
  std::array<std::uint32_t, kKinds> kinds{};
  for (int kind = 0; kind < kKinds; ++kind)
    kinds[static_cast<std::size_t>(kind)] = addMesh(model, makeThing(kind, random));
  const int count = std::max(1, static_cast<int>(triangles / 60));
  for (int i = 0; i < count; ++i) {
    const bool isOnFloor = i % 50 == 0;
    const double board = std::floor(random.drawUniform(0, kBoards));
    const Vec3 at =
        isOnFloor
            ? Vec3(random.drawUniform(0.2, 9.8), 0.001, random.drawUniform(0.2, 10.8))
            : Vec3(1 + 2.4 * std::floor(random.drawUniform(0, kRacks)) + random.drawUniform(0, 0.5),
                   0.121 + 0.4 * board, random.drawUniform(1, 10));
    place(model, "thing " + std::to_string(i), kinds[static_cast<std::size_t>(i % kKinds)], at,
          random.drawUniform(0, kTurn));
  }
  return builder.model;
}

/// A room of 12 x 12 m with pipes of all sizes along the walls, across the floor and overhead, each
/// with an elbow.
Model makePlantRoom(std::size_t triangles) {
  Random random(8);
  scene::testing::Builder builder;
  addRoom(builder, 12, 12);
  constexpr int kPipes = 60, kSides = 24;
  const int steps = std::max(4, static_cast<int>(double(triangles) / (kPipes * 2 * kSides * 3)));
  for (int i = 0; i < kPipes; ++i) {
    const double radius = random.drawUniform(0.02, 0.12), bend = 3 * radius;
    const Vec3 corner(random.drawUniform(1, 11), random.drawUniform(radius, 2.8),
                      random.drawUniform(1, 11));
    const bool isUpright = i % 3 == 0;
    const Vec3 one = i % 2 == 0 ? Vec3::UnitX() : Vec3::UnitZ();
    const Vec3 two = isUpright ? Vec3(-Vec3::UnitY()) : Vec3(one.z(), 0, one.x());
    const double second = isUpright ? std::max(0.0, corner.y() - bend) : random.drawUniform(0.5, 3);
    std::vector<Vec3> line =
        makeStraightLine(corner - one * random.drawUniform(1, 4), corner - bend * one, steps);
    for (int k = 1; k < steps; ++k) {
      const double angle = 0.5 * std::numbers::pi * k / steps;
      line.push_back(corner - bend * one +
                     bend * (std::sin(angle) * one + (1 - std::cos(angle)) * two));
    }
    for (const Vec3& point :
         makeStraightLine(corner + bend * two, corner + (bend + second) * two, steps))
      line.push_back(point);
    Mesh mesh;
    addTube(mesh, line, radius, kSides);
    builder.add("pipe " + std::to_string(i), std::move(mesh));
  }
  return builder.model;
}

/// One mesh like the scan of a room of 10 m: a rough floor with heaps, rough walls, and holes.
Model makeScan(std::size_t triangles) {
  constexpr double kEdge = 10, kHeight = 2.5, kRoughness = 0.01;
  Random random(5);
  const auto rough = [&] { return random.drawUniform(-kRoughness, kRoughness); };
  const int steps = static_cast<int>(std::sqrt(static_cast<double>(triangles) / 10));  // 5 surfaces
  Mesh mesh;
  const auto addSheet = [&](const Surface& pointAt, double holes) {
    addSurface(mesh, steps, steps, pointAt,
               [&](int, int) { return holes > 0 && random.drawUniform(0, 1) < holes; });
  };
  addSheet(
      [&](double u, double v) {
        const double heap = std::sin(7 * u) * std::sin(9 * v);
        return Vec3(kEdge * v, 0.3 * heap * heap + rough(), kEdge * u);
      },
      0);
  for (const double side : {0.0, kEdge}) {
    addSheet([&](double u, double v) { return Vec3(side + rough(), kHeight * u - 0.1, kEdge * v); },
             0.02);
    addSheet([&](double u, double v) { return Vec3(kEdge * v, kHeight * u - 0.1, side + rough()); },
             0.02);
  }
  scene::testing::Builder builder;
  builder.add("scan", std::move(mesh));
  return builder.model;
}

/// A landscape of 60 m: hills, and boulders on them.
Model makeTerrain(std::size_t triangles) {
  constexpr double kEdge = 60;
  constexpr int kBoulders = 150;
  Random random(9);
  const auto heightAt = [](double x, double z) {
    return 1.5 * std::sin(0.17 * x) * std::cos(0.13 * z) + 0.15 * std::sin(1.1 * x + 0.7 * z) +
           0.03 * std::sin(5.3 * x) * std::sin(4.7 * z);
  };
  scene::testing::Builder builder;
  const int steps = static_cast<int>(std::sqrt(0.7 * double(triangles) / 2));
  Mesh ground;
  addSurface(ground, steps, steps, [&](double u, double v) {
    return Vec3(kEdge * v, heightAt(kEdge * v, kEdge * u), kEdge * u);
  });
  builder.add("ground", std::move(ground));
  const int boulderSteps =
      std::max(4, static_cast<int>(std::sqrt(0.3 * double(triangles) / (4 * kBoulders))));
  for (int i = 0; i < kBoulders; ++i) {
    const double x = random.drawUniform(1, kEdge - 1), z = random.drawUniform(1, kEdge - 1);
    const double size = random.drawUniform(0.1, 0.6);
    Mesh boulder;
    addCushion(boulder, {x, heightAt(x, z), z}, {size, 0.6 * size, 0.8 * size}, boulderSteps);
    builder.add("boulder " + std::to_string(i), std::move(boulder));
  }
  return builder.model;
}

}  // namespace

const std::vector<DenseScene>& listDenseScenes() {
  static const std::vector<DenseScene> scenes{
      {"scan", "a scanned room of 10 m, one mesh with holes", makeScan},
      {"office", "an office of 10 x 11 m: 20 chairs, 12 plants, 40 cables", makeOffice},
      {"shop", "a shop of 10 x 11 m: racks full of small objects of 60 triangles each", makeShop},
      {"plant_room", "a plant room of 12 m: 60 pipes with elbows", makePlantRoom},
      {"terrain", "a landscape of 60 m with 150 boulders", makeTerrain}};
  return scenes;
}

const DenseScene* findDenseScene(const std::string& name) {
  for (const DenseScene& scene : listDenseScenes())
    if (scene.name == name) return &scene;
  return nullptr;
}

}  // namespace enfilade::tests
