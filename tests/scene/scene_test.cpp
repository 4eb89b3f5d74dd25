#include "scene/world/data/scene.hpp"

#include <gtest/gtest.h>

#include <random>
#include <thread>

namespace enfilade::scene {
namespace {

/// Random triangles by seed in `objects` objects, some of them degenerate.
Model makeRandomModel(unsigned seed, std::size_t objects) {
  std::mt19937 random(seed);
  const auto number = [&] { return static_cast<float>(random() % 2001) / 100.0f - 10.0f; };
  Model model;
  model.materials.emplace_back();
  for (std::size_t i = 0; i < objects; ++i) {
    Mesh mesh;
    for (int v = 0; v < 12; ++v) {
      const float x = number(), y = number(), z = number();
      mesh.positions.emplace_back(x, y, z);
    }
    for (int t = 0; t < 20; ++t) {
      for (int k = 0; k < 3; ++k) mesh.indices.push_back(static_cast<std::uint32_t>(random() % 12));
    }
    model.meshes.push_back(mesh);
    Object object;
    object.path = "object" + std::to_string(i);
    object.meshes = {static_cast<std::uint32_t>(i)};
    const float x = number(), y = number(), z = number();
    object.worldFromMesh.translation() = Vec3(x, y, z);
    object.worldFromMesh.linear() *= 0.37;
    model.objects.push_back(object);
  }
  return model;
}

TEST(Scene, BoxesOfManyObjectsAreThoseOfOneThreadAndTheHashIsRepeatable) {
  // More objects than two threads take at once; meshes below and above the limit of the search for
  // repeated positions.
  Model model = makeRandomModel(3, 4);
  for (int repeats = 0; repeats < 3; ++repeats) {
    Mesh& large = model.meshes[0];
    large.positions.insert(large.positions.end(), large.positions.begin(), large.positions.end());
  }
  const std::size_t vertices = model.meshes[0].positions.size();
  for (std::uint32_t i = 0; i + 2 < vertices; i += 3)
    model.meshes[0].indices.insert(model.meshes[0].indices.end(), {i, i + 1, i + 2});
  ASSERT_GT(vertices, 65u);
  std::mt19937 random(4);
  const auto draw = [&] { return static_cast<double>(random() % 1000); };
  while (model.objects.size() < 10'000) {
    Object object = model.objects[random() % 4];
    object.path = "copy" + std::to_string(model.objects.size());
    object.worldFromMesh.translation() += 0.5 * Vec3(draw(), draw(), draw());
    if (random() % 7 == 0) object.worldFromMesh.linear().setZero();
    if (random() % 5 == 0) object.usage = Object::Usage::visualOnly;
    model.objects.push_back(object);
  }
  const Scene scene{Model(model)};
  std::vector<std::uint32_t> solid;
  std::vector<Aabb> boxes;
  for (std::uint32_t i = 0; i < model.objects.size(); ++i) {
    const Object& object = model.objects[i];
    if (object.worldFromMesh.linear().isZero(0) || object.usage == Object::Usage::visualOnly)
      continue;
    Aabb box;
    const Mesh& mesh = model.meshes[object.meshes[0]];
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
      const std::uint32_t* corners = &mesh.indices[t];
      if (hasExactArea(mesh.positions[corners[0]], mesh.positions[corners[1]],
                       mesh.positions[corners[2]]))
        for (int k = 0; k < 3; ++k) box.include(computeWorldPosition(object, mesh, corners[k]));
    }
    solid.push_back(i);
    boxes.push_back(box);
  }
  EXPECT_EQ(scene.solidObjects(), solid);
  ASSERT_EQ(scene.staticBoxes().size(), boxes.size());
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    ASSERT_EQ(scene.staticBoxes()[i].min, boxes[i].min) << i;
    ASSERT_EQ(scene.staticBoxes()[i].max, boxes[i].max) << i;
  }
  EXPECT_EQ(scene.hash(), Scene(std::move(model)).hash());
}

TEST(Scene, BoxesAreExactlyTheExtremesOfTheTrianglesWithArea) {
  const Scene scene(makeRandomModel(7, 40));
  std::size_t skipped = 0;
  for (std::size_t i = 0; i < scene.solidObjects().size(); ++i) {
    const Object& object = scene.model().objects[scene.solidObjects()[i]];
    const Mesh& mesh = scene.model().meshes[object.meshes[0]];
    Aabb box;
    std::size_t solid = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3) {
      const Vec3 a = computeWorldPosition(object, mesh, mesh.indices[t]);
      const Vec3 b = computeWorldPosition(object, mesh, mesh.indices[t + 1]);
      const Vec3 c = computeWorldPosition(object, mesh, mesh.indices[t + 2]);
      if (a == b || b == c || c == a) {
        ++skipped;
        continue;
      }
      ++solid;
      for (const Vec3& p : {a, b, c}) box.include(p);
    }
    EXPECT_EQ(scene.staticBoxes()[i].min, box.min);
    EXPECT_EQ(scene.staticBoxes()[i].max, box.max);
    const Shape& shape = scene.shape(scene.solidObjects()[i]);
    EXPECT_EQ(shape.triangles.size() + shape.duplicate, solid);
    EXPECT_EQ(shape.degenerate, mesh.indices.size() / 3 - solid);
    EXPECT_EQ(scene.collisionGeometry(scene.solidObjects()[i]).size(), shape.triangles.size());
  }
  EXPECT_GT(skipped, 50u);
}

TEST(Scene, ObjectsWithoutAreaCannotBeTouched) {
  Model model = makeRandomModel(8, 3);
  model.meshes[1].indices = {0, 0, 1, 2, 2, 2};
  const Scene scene(std::move(model));
  EXPECT_EQ(scene.solidObjects(), (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(scene.collisionGeometry(1).size(), 0u);
}

TEST(Scene, AnEmptyModelIsAnEmptyScene) {
  const Scene scene{Model()};
  EXPECT_TRUE(scene.solidObjects().empty());
  EXPECT_TRUE(scene.bounds().empty());
}

TEST(Scene, HashFollowsPositionsPathsAndPlacesOnly) {
  const std::uint64_t hash = Scene(makeRandomModel(9, 5)).hash();
  EXPECT_EQ(Scene(makeRandomModel(9, 5)).hash(), hash);
  Model recoloured = makeRandomModel(9, 5);
  recoloured.materials[0].baseColour.setZero();
  EXPECT_EQ(Scene(recoloured).hash(), hash);
  Model moved = makeRandomModel(9, 5);
  moved.objects[3].worldFromMesh.translation().x() += 1e-12;
  EXPECT_NE(Scene(moved).hash(), hash);
  Model renamed = makeRandomModel(9, 5);
  renamed.objects[3].path += "x";
  EXPECT_NE(Scene(renamed).hash(), hash);
  Model bent = makeRandomModel(9, 5);
  bent.meshes[2].positions[4].y() = 11;
  EXPECT_NE(Scene(bent).hash(), hash);
}

TEST(Scene, AllCallersShareOneListOfParts) {
  const Scene scene(makeRandomModel(10, 50));
  std::vector<std::vector<const CollisionGeometry*>> seen(4);
  std::vector<std::thread> threads;
  for (auto& list : seen) {
    threads.emplace_back([&scene, &list] {
      for (std::uint32_t i = 0; i < 50; ++i) list.push_back(&scene.collisionGeometry(i));
    });
  }
  for (std::thread& thread : threads) thread.join();
  for (const auto& list : seen) EXPECT_EQ(list, seen[0]);
  EXPECT_THROW(scene.collisionGeometry(50), std::out_of_range);
  EXPECT_THROW(scene.shape(50), std::out_of_range);
}

TEST(Scene, CollisionDataIsCopiedOnlyWhenThePartsAreUsed) {
  Model model = makeRandomModel(12, 3);
  std::size_t unique = 0;
  for (const Mesh& mesh : model.meshes)
    unique += mesh.positions.size() * sizeof(mesh.positions[0]) + mesh.indices.size() * 4;
  const Object first = model.objects[0];
  for (int copy = 0; copy < 400; ++copy) model.objects.push_back(first);
  const Scene scene(std::move(model));
  EXPECT_EQ(scene.memory().geometry, 0u);
  EXPECT_EQ(scene.memory().parts, 0u);
  EXPECT_LT(scene.memory().perObject, 403 * 80);
  // Copies of a mesh share one shape, and all shapes together use at most twice the meshes' memory.
  for (std::uint32_t object = 3; object < 403; ++object) {
    ASSERT_EQ(&scene.shape(object), &scene.shape(0));
  }
  scene.shape(1);
  scene.shape(2);
  EXPECT_EQ(scene.shapeCount(), 3u);
  EXPECT_GT(scene.memory().geometry, 0u);
  EXPECT_LE(scene.memory().geometry, 2 * unique + 3 * (sizeof(Shape) + 20 * sizeof(Shell)));
  scene.collisionGeometry(0);
  EXPECT_GT(scene.memory().parts, 0u);
}

TEST(Scene, IndicesThatPointNowhereAreRefused) {
  Model model = makeRandomModel(11, 2);
  model.meshes[1].indices[4] = 12;
  EXPECT_THROW(Scene{std::move(model)}, std::invalid_argument);
}

}  // namespace
}  // namespace enfilade::scene
