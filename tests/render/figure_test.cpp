// Tests of figures: their meshes, against the collision shape, and pictures of both renderers,
// against brute force.
#include "render/figure.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "render/optical_flow.hpp"
#include "render/raytrace/ray_renderer.hpp"
#include "render/renderer_kind.hpp"
#include "tests/render/brute_force_rays.hpp"
#include "tests/render/render_fixtures.hpp"

namespace enfilade::render {
namespace {

/// A person of the given height at the spawn, now `height` high, who looks along `view`.
scene::AvatarSnapshot makePersonAt(scene::EntityId id, const Vec3& feet, const Vec3& view,
                                   double height = 1.75, double radius = 0.3,
                                   double spawnHeight = 1.75) {
  scene::AvatarSnapshot person;
  person.id = id;
  person.footPosition = feet;
  person.viewDirection = view.normalized();
  person.height = height;
  person.spawnHeight = spawnHeight;
  person.eyeHeight = scene::computeEyeHeight(height);
  person.shape = scene::makePrismShape(radius, height, spawnHeight, {});
  return person;
}

Vec3 computeDirection(double degrees) {
  const double radians = degrees * 3.14159265358979323846 / 180;
  return {std::cos(radians), 0, -std::sin(radians)};
}

using Triangles = std::vector<std::pair<scene::EntityId, collision::Triangle>>;

Triangles makeTriangles(const scene::AvatarSnapshot& person) {
  const Figure figure = placeFigure(person);
  Triangles triangles;
  for (std::size_t i = 0; i < figure.mesh->indices.size(); i += 3) {
    collision::Triangle triangle;
    for (std::size_t c = 0; c < 3; ++c)
      triangle[c] =
          figure.worldFromMesh * figure.mesh->positions[figure.mesh->indices[i + c]].cast<double>();
    triangles.emplace_back(person.id, triangle);
  }
  return triangles;
}

/// The greatest distance of a point of the figure outside the collision shape, metres.
double computeFarthestOutside(const scene::AvatarSnapshot& person) {
  const collision::Hull& hull = *person.shape->parts.front().hull;
  double farthest = -1;
  for (const auto& [id, triangle] : makeTriangles(person)) {
    for (const Vec3& corner : triangle) {
      for (const auto& face : hull.faces) {
        const Vec3& a = hull.vertices[face[0]];
        const Vec3 normal =
            (hull.vertices[face[1]] - a).cross(hull.vertices[face[2]] - a).normalized();
        farthest = std::max(farthest, normal.dot(corner - person.footPosition - a));
      }
    }
  }
  return farthest;
}

double computeTop(const scene::AvatarSnapshot& person) {
  double top = -1;
  for (const auto& [id, triangle] : makeTriangles(person))
    for (const Vec3& corner : triangle) top = std::max(top, corner.y() - person.footPosition.y());
  return top;
}

TEST(Figure, LiesWithinTheCollisionShapeAndIsAsHigh) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> fraction(0, 1);
  for (int i = 0; i < 300; ++i) {
    const double standing = 0.5 + 1.7 * fraction(random), radius = 0.1 + 0.5 * fraction(random);
    const double height = standing * (i % 3 == 0 ? 1 : 0.3 + 0.7 * fraction(random));
    const Vec3 feet(10 * fraction(random), fraction(random), -4);
    const auto person =
        makePersonAt(9, feet, computeDirection(360 * fraction(random)), height, radius, standing);
    ASSERT_TRUE(isPerson(person));
    EXPECT_LT(computeFarthestOutside(person), 1e-6) << standing << ' ' << radius << ' ' << height;
    EXPECT_NEAR(computeTop(person), height, 1e-6);
  }
}

TEST(Figure, MeshesAreClosedAndTheirNormalsPointOutwards) {
  for (double height = 1.75; height > 0.5; height -= 0.05) {
    const Figure figure = placeFigure(makePersonAt(9, Vec3(1, 2, 3), computeDirection(70), height));
    const scene::Mesh& mesh = *figure.mesh;
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    const Eigen::Matrix3d worldFromNormal = figure.worldFromMesh.linear().inverse().transpose();
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    double volume = 0;  // cubic metres
    std::size_t inwards = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const std::uint32_t* c = &mesh.indices[i];
      const auto corner = [&](std::size_t k) {
        return Vec3(figure.worldFromMesh.linear() * mesh.positions[c[k]].cast<double>());
      };
      const Vec3 normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      volume += corner(0).dot(normal) / 6;
      for (std::size_t k = 0; k < 3; ++k) {
        ++edges[{c[k], c[(k + 1) % 3]}];
        if ((worldFromNormal * mesh.normals[c[k]].cast<double>()).dot(normal) < 0) ++inwards;
      }
    }
    for (const auto& [edge, count] : edges) {
      ASSERT_EQ(count, 1);
      ASSERT_EQ(edges.count({edge.second, edge.first}), 1u);
    }
    EXPECT_GT(volume, 0.025);
    EXPECT_LT(volume, 0.12);
    EXPECT_LE(inwards, 2u) << "only at the sharp ends";
    for (const Eigen::Vector3f& normal : mesh.normals) EXPECT_NEAR(normal.norm(), 1, 1e-5);
  }
}

TEST(Figure, OnlyAMerePrismIsAPerson) {
  auto person = makePersonAt(9, Vec3::Zero(), Vec3::UnitX());
  EXPECT_TRUE(isPerson(person));
  person.joints.resize(1);
  EXPECT_FALSE(isPerson(person)) << "a machine with links";
  EXPECT_FALSE(isPerson(makeAvatarAt(9, Vec3::Zero()))) << "parts of its own";
}

/// Three people ahead of makeSquareCamera(), before a wall (object 1).
scene::Snapshot makeGroup() {
  scene::Snapshot snapshot;
  snapshot.avatars = {makePersonAt(2, {-1.2, -1, -4}, computeDirection(-60)),
                      makePersonAt(3, {0, -1, -3.4}, computeDirection(200), 1.1),
                      makePersonAt(4, {1.1, -1, -3.7}, computeDirection(90), 1.3, 0.25, 1.4)};
  return snapshot;
}

class Figures : public testing::TestWithParam<RendererKind> {
 protected:
  const std::shared_ptr<const scene::Scene> wall_ = makeScene({{{0, 0, -8}, {40, 40, 1}, {}}});
  std::unique_ptr<Renderer> renderer_ = makeRenderer();

  std::unique_ptr<Renderer> makeRenderer() const {
    if (GetParam() == RendererKind::gl) return std::make_unique<GlRenderer>(wall_);
    return std::make_unique<RayRenderer>(wall_);
  }
};

TEST_P(Figures, IdsAndDepthAreThoseOfTheDrawnShape) {
  const scene::Snapshot snapshot = makeGroup();
  Triangles all;
  for (const auto& person : snapshot.avatars)
    for (const auto& one : makeTriangles(person)) all.push_back(one);
  const Frame frame = renderer_->render(snapshot, makeSquareCamera(160));
  EXPECT_EQ(frame.avatars, AvatarForm::figure);
  std::size_t people = 0, others = 0;
  for (int y = 40; y < 130; ++y) {
    for (int x = 20; x < 150; ++x) {
      const Vec3 way((x + 0.5) / 80 - 1, 1 - (y + 0.5) / 80, -1);
      const BruteHit hit = findBruteHit(all, frame.camera, Vec3::Zero(), way);
      const std::size_t pixel = getPixelIndex(frame, x, y);
      if (hit.id != 0) ++people;
      if (frame.ids[pixel] != (hit.id != 0 ? hit.id : 1)) {
        ++others;
      } else if (hit.id != 0 && hit.inside > 0.02) {
        EXPECT_NEAR(frame.depth[pixel], hit.depth, 2e-3) << x << ' ' << y;
      }
    }
  }
  EXPECT_GT(people, 450u);
  EXPECT_LE(others, people / 100) << "only at outlines";
}

TEST_P(Figures, ColourShowsTheSamePixelsAsIds) {
  FrameOptions options;
  const Frame people = renderer_->render(makeGroup(), makeSquareCamera(160), options);
  const Frame empty = renderer_->render({}, makeSquareCamera(160), options);
  std::size_t differ = 0, covered = 0;
  for (std::size_t i = 0; i < people.ids.size(); ++i) {
    int change = 0;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      change = std::max(change, std::abs(int{people.rgb[c]} - int{empty.rgb[c]}));
    if (people.ids[i] > 1) ++covered;
    if ((people.ids[i] > 1) != (change > 20)) ++differ;  // ambient occlusion changes less
  }
  EXPECT_GT(covered, 450u);
  EXPECT_LE(differ, covered / 50);
}

TEST_P(Figures, TheCollisionShapeIsDrawnOnRequest) {
  const scene::Snapshot snapshot = makeGroup();
  FrameOptions options;
  options.channels.normals = true;
  const Frame figures = renderer_->render(snapshot, makeSquareCamera(), options);
  options.avatars = AvatarForm::collision;
  const Frame shapes = renderer_->render(snapshot, makeSquareCamera(), options);
  EXPECT_EQ(shapes.avatars, AvatarForm::collision);
  std::size_t figurePixels = 0, shapePixels = 0, outside = 0, nearer = 0;
  for (std::size_t i = 0; i < shapes.ids.size(); ++i) {
    if (figures.ids[i] > 1) ++figurePixels;
    if (shapes.ids[i] > 1) ++shapePixels;
    if (figures.ids[i] > 1 && shapes.ids[i] <= 1) ++outside;
    if (figures.ids[i] == shapes.ids[i] && figures.depth[i] < shapes.depth[i] - 2e-3f) ++nearer;
  }
  EXPECT_GT(shapePixels, 1.5 * static_cast<double>(figurePixels));
  EXPECT_EQ(outside, 0u);
  EXPECT_EQ(nearer, 0u);
  options.avatars = AvatarForm::figure;
  const Frame again = renderer_->render(snapshot, makeSquareCamera(), options);
  EXPECT_TRUE(again.rgb == figures.rgb && again.ids == figures.ids);
  EXPECT_TRUE(again.normals == figures.normals);
}

TEST_P(Figures, ACrouchingPersonIsLowerAndATurnedOneFacesTheOtherWay) {
  const auto outline = [&](double height, double degrees) {
    scene::Snapshot snapshot;
    snapshot.avatars = {makePersonAt(2, {0, -1, -3}, computeDirection(degrees), height)};
    return renderer_->render(snapshot, makeSquareCamera(), {}).ids;
  };
  const auto top = [](const std::vector<std::uint32_t>& ids) {
    return std::ranges::find(ids, 2u) - ids.begin();
  };
  const auto standing = outline(1.75, 0), crouching = outline(1.0, 0);
  EXPECT_NEAR(static_cast<double>(top(crouching) - top(standing)) / 200, 0.75 * 100 / 3, 2);
  const auto turned = outline(1.75, 180);
  std::size_t mirrored = 0, same = 0, covered = 0;
  for (std::size_t i = 0; i < standing.size(); ++i) {
    const std::size_t row = i / 200, column = i % 200;
    if (standing[i] != 2) continue;
    ++covered;
    if (turned[200 * row + 199 - column] == 2) ++mirrored;
    if (turned[i] == 2) ++same;
  }
  EXPECT_GE(mirrored, covered - 5);
  EXPECT_LT(same, covered - 25);
}

TEST_P(Figures, AnAvatarsOwnEyesDoNotSeeItsFigure) {
  scene::Snapshot snapshot = makeGroup();
  const scene::AvatarSnapshot& viewer = snapshot.avatars[1];
  const Camera camera = makeFirstPersonCamera(viewer, 64, 64, 2.5);
  EXPECT_EQ(findIdsIn(renderer_->render(snapshot, camera)).count(3), 1u) << "from within its head";
  EXPECT_EQ(findIdsIn(renderer_->render(snapshot, camera, {.hiddenEntity = 3})).count(3), 0u);
}

TEST_P(Figures, FlowFollowsTheTurningFigure) {
  scene::Snapshot then, now;
  then.avatars = {makePersonAt(2, {0.1, -1, -2}, computeDirection(20))};
  now.avatars = {makePersonAt(2, {0, -1, -1.9}, computeDirection(40))};
  now.avatars[0].shape = then.avatars[0].shape;
  const Frame before = renderer_->render(then, makeSquareCamera(400));
  const Frame after = renderer_->render(now, makeSquareCamera(400));
  const std::vector<float> flow =
      computeOpticalFlow(after, *wall_, now, then, makeSquareCamera(400));
  // Where the flow says that a point was, the earlier picture shows the figure, too.
  std::size_t found = 0, all = 0;
  for (int y = 0; y < 400; ++y) {
    for (int x = 0; x < 400; ++x) {
      const std::size_t pixel = getPixelIndex(after, x, y);
      if (after.ids[pixel] != 2) continue;
      const int u = static_cast<int>(std::floor(x + 0.5 - static_cast<double>(flow[2 * pixel])));
      const int v =
          static_cast<int>(std::floor(y + 0.5 - static_cast<double>(flow[2 * pixel + 1])));
      ++all;
      if (u >= 0 && v >= 0 && u < 400 && v < 400 && before.ids[getPixelIndex(before, u, v)] == 2)
        ++found;
    }
  }
  EXPECT_GT(all, 4000u);
  EXPECT_GT(static_cast<double>(found), 0.97 * static_cast<double>(all));
}

TEST(FiguresOfBothRenderers, AreShadedEquallyAndSmoothly) {
  const auto wall = makeScene({{{0, 0, -8}, {40, 40, 1}, {}}});
  const FrameOptions all{.channels = {true, true, true, true}};
  const Frame gl = GlRenderer(wall).render(makeGroup(), makeSquareCamera(), all);
  const Frame rays = RayRenderer(wall).render(makeGroup(), makeSquareCamera(), all);
  std::size_t people = 0, turned = 0, tinted = 0;
  for (std::size_t i = 0; i < gl.ids.size(); ++i) {
    if (gl.ids[i] < 2 || gl.ids[i] != rays.ids[i]) continue;
    using Normal = Eigen::Map<const Eigen::Vector3f>;
    ++people;
    if (Normal(&gl.normals[3 * i]).dot(Normal(&rays.normals[3 * i])) < 0.995f) ++turned;
    for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
      if (std::abs(int{gl.rgb[c]} - int{rays.rgb[c]}) > 4) ++tinted;
  }
  EXPECT_GT(people, 700u);
  EXPECT_LT(turned, people / 50);
  EXPECT_LT(tinted, people / 10);
}

INSTANTIATE_TEST_SUITE_P(OfBothRenderers, Figures,
                         testing::Values(RendererKind::gl, RendererKind::rays),
                         [](const auto& kind) { return std::string(toString(kind.param)); });

}  // namespace
}  // namespace enfilade::render
