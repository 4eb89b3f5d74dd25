#include "tests/server/small_room.hpp"

#include <array>
#include <sstream>

namespace enfilade::server::testing {
namespace {

struct NamedBox {
  const char* name;
  scene::Aabb box;
};

const std::array<NamedBox, 3> kBoxes{
    {{"room_floor", {scene::Vec3(-10, -0.5, -10), scene::Vec3(10, 0, 10)}},
     {"room_wall", {scene::Vec3(5, 0, -4), scene::Vec3(5.2, 3, 4)}},
     {"room_column", {scene::Vec3(-0.25, 0, 5.75), scene::Vec3(0.25, 3, 6.25)}}}};

/// Corner i of a box: bit 0 chooses x, bit 1 y, bit 2 z.
scene::Vec3 getCorner(const scene::Aabb& box, unsigned i) {
  return {i & 1 ? box.max.x() : box.min.x(), i & 2 ? box.max.y() : box.min.y(),
          i & 4 ? box.max.z() : box.min.z()};
}

constexpr std::array<std::uint32_t, 36> kTriangles{0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5,
                                                   0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3,
                                                   0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6};

}  // namespace

std::shared_ptr<const scene::Scene> makeSmallRoom() {
  scene::Model model;
  model.source = "small_room";
  model.materials.emplace_back();
  for (const NamedBox& named : kBoxes) {
    scene::Mesh mesh;
    mesh.name = named.name;
    for (unsigned i = 0; i < 8; ++i)
      mesh.positions.push_back(getCorner(named.box, i).cast<float>());
    mesh.indices.assign(kTriangles.begin(), kTriangles.end());
    scene::Object object;
    object.path = named.name;
    object.meshes = {static_cast<std::uint32_t>(model.meshes.size())};
    model.meshes.push_back(std::move(mesh));
    model.objects.push_back(std::move(object));
  }
  return std::make_shared<const scene::Scene>(std::move(model));
}

std::string makeSmallRoomObj() {
  std::ostringstream text;
  std::uint32_t first = 1;
  for (const NamedBox& named : kBoxes) {
    text << "o " << named.name << "\n";
    for (unsigned i = 0; i < 8; ++i) text << "v " << getCorner(named.box, i).transpose() << "\n";
    for (std::size_t t = 0; t < kTriangles.size(); t += 3) {
      text << "f " << first + kTriangles[t] << " " << first + kTriangles[t + 1] << " "
           << first + kTriangles[t + 2] << "\n";
    }
    first += 8;
  }
  return text.str();
}

}  // namespace enfilade::server::testing
