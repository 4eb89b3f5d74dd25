// Memory that a scene and its world use for collision. Every operator new and delete of this
// program is counted with the size that the allocator reports.
#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>
#include <utility>

#include "assets/building.hpp"
#include "scene/world/world.hpp"

namespace {

std::atomic<std::size_t> held{0};

/// Null: the allocation failed.
void* tryToTake(std::size_t size, std::align_val_t alignment) noexcept {
  const auto align = static_cast<std::size_t>(alignment);
  const std::size_t whole = (std::max<std::size_t>(size, 1) + align - 1) / align * align;
  void* const place = std::aligned_alloc(align, whole);
  if (place) held += malloc_usable_size(place);
  return place;
}

constexpr std::align_val_t kPlain{__STDCPP_DEFAULT_NEW_ALIGNMENT__};

void* take(std::size_t size, std::align_val_t alignment = kPlain) {
  void* const place = tryToTake(size, alignment);
  if (!place) throw std::bad_alloc();
  return place;
}

void giveBack(void* place) noexcept {
  if (place) held -= malloc_usable_size(place);
  std::free(place);
}

}  // namespace

void* operator new(std::size_t size) {
  return take(size);
}
void* operator new[](std::size_t size) {
  return take(size);
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return tryToTake(size, kPlain);
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return take(size, alignment);
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return take(size, alignment);
}
void operator delete(void* place, const std::nothrow_t&) noexcept {
  giveBack(place);
}
void operator delete(void* place, std::align_val_t) noexcept {
  giveBack(place);
}
void operator delete[](void* place, std::align_val_t) noexcept {
  giveBack(place);
}
void operator delete(void* place, std::size_t, std::align_val_t) noexcept {
  giveBack(place);
}
void operator delete[](void* place, std::size_t, std::align_val_t) noexcept {
  giveBack(place);
}
void operator delete(void* place) noexcept {
  giveBack(place);
}
void operator delete[](void* place) noexcept {
  giveBack(place);
}
void operator delete(void* place, std::size_t) noexcept {
  giveBack(place);
}
void operator delete[](void* place, std::size_t) noexcept {
  giveBack(place);
}

namespace enfilade::scene {
namespace {

/// Bytes of all meshes, each counted once however many objects share it.
std::size_t countUniqueBytes(const Model& model) {
  std::size_t bytes = 0;
  for (const Mesh& mesh : model.meshes)
    bytes += mesh.positions.size() * sizeof(mesh.positions[0]) +
             mesh.indices.size() * sizeof(mesh.indices[0]);
  return bytes;
}

/// A bumpy globe of about 2 * rings^2 triangles.
Mesh makeGlobe(std::uint32_t rings) {
  Mesh mesh;
  for (std::uint32_t i = 0; i <= rings; ++i)
    for (std::uint32_t k = 0; k <= rings; ++k) {
      const double up = 3.14159 * i / rings, round = 6.28318 * k / rings;
      const double r = 1 + 0.1 * std::sin(9 * up) * std::cos(7 * round);
      mesh.positions.emplace_back(static_cast<float>(r * std::sin(up) * std::cos(round)),
                                  static_cast<float>(r * std::cos(up)),
                                  static_cast<float>(r * std::sin(up) * std::sin(round)));
    }
  for (std::uint32_t i = 0; i < rings; ++i)
    for (std::uint32_t k = 0; k < rings; ++k) {
      const std::uint32_t a = i * (rings + 1) + k, b = a + rings + 1;
      mesh.indices.insert(mesh.indices.end(), {a, b, a + 1, a + 1, b, b + 1});
    }
  return mesh;
}

/// Each globe is placed `copies` times.
Model makeGlobes(int meshes, std::uint32_t rings, int copies) {
  Model model;
  model.source = "globes";
  model.materials.emplace_back();
  for (int m = 0; m < meshes; ++m) {
    model.meshes.push_back(makeGlobe(rings + static_cast<std::uint32_t>(m)));
    for (int c = 0; c < copies; ++c) {
      Object object;
      object.path = "globe" + std::to_string(m) + "/" + std::to_string(c);
      object.meshes = {static_cast<std::uint32_t>(m)};
      object.worldFromMesh.translation() = Vec3(3.0 * m, 0, 3.0 * c);
      model.objects.push_back(std::move(object));
    }
  }
  return model;
}

/// The bundled building with its doors and lift as bodies.
Model makeBuildingWithBodies() {
  std::vector<assets::MovingPart> parts;
  Model model = assets::makeBuilding({}, &parts);
  for (const assets::MovingPart& part : parts) {
    const Eigen::Affine3d& placed = model.objects[part.object].worldFromMesh;
    BodySpec spec;
    spec.name = "body" + std::to_string(part.object);
    spec.kind = part.kind == assets::MovingPart::Kind::hinge ? BodyKind::hinged : BodyKind::sliding;
    spec.objects = {part.object};
    spec.anchor = placed.translation();
    spec.axis = (placed.linear() * part.axis).normalized();
    spec.low = part.low, spec.high = part.high;
    model.bodies.push_back(spec);
  }
  return model;
}

/// Bytes that a scene and a world of it allocate, without the model.
struct Cost {
  std::size_t scene = 0;   ///< before any avatar comes near
  std::size_t world = 0;   ///< before any avatar comes near
  std::size_t shapes = 0;  ///< after the shapes of all objects were built
  std::size_t parts = 0;   ///< after the parts of all objects were built
  std::size_t sumBeforeParts() const { return scene + world + shapes; }
};
Cost measureCost(Model model, bool withParts = false) {
  const auto objects = static_cast<std::uint32_t>(model.objects.size());
  std::size_t last = held;
  const auto more = [&last] {
    const std::size_t now = held;
    return now - std::exchange(last, now);
  };
  Cost cost;
  const auto scene = std::make_shared<const Scene>(std::move(model));
  cost.scene = more();
  World world(scene);
  tickWorld(world);
  cost.world = more();
  for (std::uint32_t i = 0; i < objects; ++i) scene->shape(i);
  cost.shapes = more();
  for (std::uint32_t i = 0; withParts && i < objects; ++i) scene->collisionGeometry(i);
  cost.parts = more();
  return cost;
}

TEST(CollisionMemory, OfTheBundledBuildingIsAtMostTwiceItsMeshesBeforeThePartsAreUsed) {
  Model model = makeBuildingWithBodies();
  EXPECT_GT(model.bodies.size(), 10u);
  const std::size_t unique = countUniqueBytes(model);
  const Cost cost = measureCost(std::move(model));
  EXPECT_GT(cost.sumBeforeParts(), unique / 4) << "the allocation is counted";
  EXPECT_LE(cost.sumBeforeParts(), 2 * unique);
}

TEST(CollisionMemory, OfLargeMeshesIsAtMostTwiceTheseUntilThePartsAreUsed) {
  Model model = makeGlobes(6, 60, 1);
  const std::size_t unique = countUniqueBytes(model);
  const Cost cost = measureCost(std::move(model), true);
  EXPECT_LE(cost.scene + cost.world, unique / 100) << "nothing is copied before its first use";
  EXPECT_LE(cost.sumBeforeParts(), 2 * unique);
  EXPECT_GT(cost.sumBeforeParts() + cost.parts, 2 * unique) << "excess memory is detected";
}

TEST(CollisionMemory, OfAMeshThatStandsFourHundredTimesIsThatOfOneAndAFewNumbersEach) {
  Model once = makeGlobes(6, 60, 1), often = makeGlobes(6, 60, 400);
  const std::size_t unique = countUniqueBytes(often);
  const std::size_t more = often.objects.size() - once.objects.size();
  const Cost one = measureCost(std::move(once)), many = measureCost(std::move(often));
  EXPECT_LE(many.sumBeforeParts(), 2 * unique);
  EXPECT_LE(many.sumBeforeParts() - one.sumBeforeParts(), 256 * more);
  EXPECT_LE(many.shapes, one.shapes + 4096);
}

}  // namespace
}  // namespace enfilade::scene
