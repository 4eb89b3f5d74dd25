#include "assets/building.hpp"

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <set>

#include "assets/landmarks.hpp"

namespace enfilade::assets {
namespace {

using scene::Aabb;
using scene::Model;
using scene::Object;
using scene::Vec3;

const Model& getBuilding() {
  static const Model model = makeBuilding();
  return model;
}

Aabb computeBox(const Model& model, const Object& object) {
  Aabb box;
  for (std::uint32_t mesh : object.meshes)
    for (std::uint32_t i = 0; i < model.meshes[mesh].positions.size(); ++i)
      box.include(computeWorldPosition(object, model.meshes[mesh], i));
  return box;
}

Aabb computeBox(const std::string& path) {
  for (const Object& object : getBuilding().objects)
    if (object.path == path) return computeBox(getBuilding(), object);
  ADD_FAILURE() << "no object " << path;
  return {};
}

template <typename Visit>
void forEachTriangle(const Model& model, const Object& object, Visit visit) {
  for (std::uint32_t m : object.meshes) {
    const scene::Mesh& mesh = model.meshes[m];
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3)
      visit(computeWorldPosition(object, mesh, mesh.indices[i]),
            computeWorldPosition(object, mesh, mesh.indices[i + 1]),
            computeWorldPosition(object, mesh, mesh.indices[i + 2]));
  }
}

/// Counts edges (by position, over all meshes of the object) without an equal number of opposite
/// ones.
std::size_t countUnmatchedEdges(const Model& model, const Object& object) {
  using Corner = std::array<float, 3>;
  std::map<std::pair<Corner, Corner>, int> balance;
  const auto corner = [](const Eigen::Vector3f& p) {
    return Corner{p.x() + 0.0f, p.y() + 0.0f, p.z() + 0.0f};
  };
  for (std::uint32_t m : object.meshes) {
    const scene::Mesh& mesh = model.meshes[m];
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      const std::size_t next = i % 3 == 2 ? i - 2 : i + 1;
      const Corner a = corner(mesh.positions[mesh.indices[i]]);
      const Corner b = corner(mesh.positions[mesh.indices[next]]);
      a < b ? ++balance[{a, b}] : --balance[{b, a}];
    }
  }
  std::size_t open = 0;
  for (const auto& [edge, count] : balance) open += count != 0;
  return open;
}

double computeVolume(const Model& model, const Object& object) {
  double volume = 0;
  const Vec3 origin = object.worldFromMesh.translation();
  forEachTriangle(model, object, [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    volume += (a - origin).dot((b - origin).cross(c - origin)) / 6;
  });
  return volume;
}

TEST(Building, HasTheRequestedNumberOfObjects) {
  EXPECT_GE(getBuilding().objects.size(), 2000u);
  EXPECT_LE(getBuilding().objects.size(), 5000u);
  EXPECT_LT(getBuilding().meshes.size(), getBuilding().objects.size() * 2 / 3);
}

TEST(Building, NamesEveryObjectOnce) {
  std::set<std::string> paths;
  for (const Object& object : getBuilding().objects)
    EXPECT_TRUE(paths.insert(object.path).second) << object.path;
  EXPECT_TRUE(paths.contains("building/ground/enfilade/room1/bench1/leg2"));
}

TEST(Building, MakesClosedSolidsThatFaceOutwards) {
  std::size_t solids = 0;
  for (const Object& object : getBuilding().objects) {
    if (object.path.ends_with("/canvas")) continue;  // paint is a set of flat patches
    ++solids;
    EXPECT_EQ(countUnmatchedEdges(getBuilding(), object), 0u) << object.path;
    EXPECT_GT(computeVolume(getBuilding(), object), 0) << object.path;
  }
  EXPECT_GT(solids, 2000u);
}

TEST(Building, HasUnitNormalsThatAgreeWithTheWinding) {
  for (const scene::Mesh& mesh : getBuilding().meshes) {
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size()) << mesh.name;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const auto corner = [&](std::size_t k) -> const Eigen::Vector3f& {
        return mesh.positions[mesh.indices[i + k]];
      };
      const Eigen::Vector3f area = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      ASSERT_GT(area.norm(), 0) << mesh.name << " triangle " << i / 3;
      for (std::size_t k = 0; k < 3; ++k) {
        const Eigen::Vector3f& n = mesh.normals[mesh.indices[i + k]];
        EXPECT_NEAR(n.norm(), 1, 1e-5) << mesh.name;
        EXPECT_GT(n.dot(area), 0) << mesh.name << " triangle " << i / 3;
      }
    }
  }
}

TEST(Building, LeavesTheAxisOfTheEnfiladeFree) {
  const Aabb corridor{{-0.3, 0.02, -0.35}, {49, 2.0, 0.35}};
  std::size_t seen = 0;
  for (const Object& object : getBuilding().objects) {
    if (!overlaps(computeBox(getBuilding(), object), corridor)) continue;
    forEachTriangle(getBuilding(), object, [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      Aabb box;
      for (const Vec3& p : {a, b, c}) box.include(p);
      EXPECT_FALSE(overlaps(box, corridor)) << object.path;
    });
    ++seen;
  }
  EXPECT_LT(seen, 100u);
}

/// Height of the highest surface at most 0.02 above `y`, straight below a point; -1e9 if none was
/// found.
double findFloorBelow(double x, double z, double y) {
  double floor = -1e9;
  for (const Object& object : getBuilding().objects) {
    const Aabb box = computeBox(getBuilding(), object);
    if (box.min.x() > x || box.max.x() < x || box.min.z() > z || box.max.z() < z) continue;
    forEachTriangle(getBuilding(), object, [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      const double area = (b.x() - a.x()) * (c.z() - a.z()) - (c.x() - a.x()) * (b.z() - a.z());
      if (area == 0) return;
      const double u = ((b.x() - x) * (c.z() - z) - (c.x() - x) * (b.z() - z)) / area;
      const double v = ((c.x() - x) * (a.z() - z) - (a.x() - x) * (c.z() - z)) / area;
      const double w = 1 - u - v;
      if (u < 0 || v < 0 || w < 0) return;
      const double height = u * a.y() + v * b.y() + w * c.y();
      if (height <= y + 0.02) floor = std::max(floor, height);
    });
  }
  return floor;
}

TEST(Building, HasAFloorUnderEveryDoorAndRoomOfTheEnfilade) {
  for (std::size_t i = 0; i < landmarks::kDoors.size(); ++i)
    for (const double dx : {-0.2, -0.149, 0.0, 0.151, 0.2})
      EXPECT_NEAR(findFloorBelow(landmarks::kDoors[i].x() + dx, 0.0123, 0), 0, 0.02)
          << "door " << i;
  for (const Vec3& room : landmarks::kRooms)
    EXPECT_NEAR(findFloorBelow(room.x() + 0.0123, room.z() + 0.0321, 0), 0, 0.02);
  const Vec3 head = landmarks::kStairHead, view = landmarks::kGalleryView;
  EXPECT_NEAR(findFloorBelow(head.x(), head.z() + 0.01, head.y()), 4.2, 0.02);
  EXPECT_NEAR(findFloorBelow(view.x(), view.z() + 0.01, view.y()), 4.2, 0.02);
}

TEST(Building, HasAStairThatCanBeWalked) {
  std::vector<Aabb> steps;
  for (int k = 1; k <= 24; ++k) {
    const std::string number = (k < 10 ? "0" : "") + std::to_string(k);
    steps.push_back(computeBox("building/hall/stair/" + (k == 12 ? "landing" : "tread" + number)));
  }
  double below = 0, east = steps[0].min.x();
  for (std::size_t i = 0; i < steps.size(); ++i) {
    EXPECT_LE(steps[i].max.y() - below, 0.17) << "step " << i + 1;
    EXPECT_GT(steps[i].max.y() - below, 0.15) << "step " << i + 1;
    EXPECT_GE(steps[i].size().z(), 1.6);
    if (i > 0) {
      EXPECT_GE(steps[i].min.x() - east, 0.28) << "step " << i + 1;
    }
    below = steps[i].max.y();
    east = steps[i].min.x();
  }
  EXPECT_NEAR(4.2 - below, 0.168, 1e-6);
  // Headroom over the flights: no obstacle at head height.
  for (const Aabb& step : steps) {
    Aabb heads{step.min, step.max};
    heads.min += Vec3{0.02, step.size().y() + 0.3, 0.3};
    heads.max += Vec3{-0.05, 2.1, -0.3};
    for (const Object& object : getBuilding().objects) {
      if (object.path.find("/stair/") != std::string::npos) continue;
      EXPECT_FALSE(overlaps(computeBox(getBuilding(), object), heads)) << object.path;
    }
  }
}

TEST(Building, HangsItsDoorsOnTheirHinges) {
  std::vector<MovingPart> parts;
  const Model model = makeBuilding({}, &parts);
  std::size_t hinges = 0, slides = 0;
  for (const MovingPart& part : parts) {
    const Object& object = model.objects.at(part.object);
    (part.kind == MovingPart::Kind::hinge ? hinges : slides)++;
    EXPECT_LT(part.low, part.high) << object.path;
    if (part.kind == MovingPart::Kind::slide) continue;
    EXPECT_NE(object.path.find("leaf"), std::string::npos);
    const Vec3 hinge = object.worldFromMesh.translation();
    const Aabb box = computeBox(model, object);
    // The hinge is at one end of the leaf, in the middle of its thickness.
    const double toEdge = std::min({hinge.x() - box.min.x(), box.max.x() - hinge.x(),
                                    hinge.z() - box.min.z(), box.max.z() - hinge.z()});
    EXPECT_LE(std::abs(toEdge), 0.005) << object.path;
  }
  EXPECT_GE(hinges, 20u);
  EXPECT_GE(slides, 5u);
}

TEST(District, HasTheRequestedNumberOfObjectsAndSharesMeshes) {
  for (const std::size_t wanted : {kMinDistrictObjects, std::size_t{10000}, std::size_t{100000}}) {
    const Model model = makeDistrict(wanted, 7);
    EXPECT_EQ(model.objects.size(), wanted);
    EXPECT_LT(model.meshes.size(), 12000u);
    std::set<std::string> paths;
    for (const Object& object : model.objects) {
      ASSERT_TRUE(paths.insert(object.path).second) << object.path;
      for (std::uint32_t mesh : object.meshes) ASSERT_LT(mesh, model.meshes.size());
    }
    for (const scene::Mesh& mesh : model.meshes) ASSERT_LT(mesh.material, model.materials.size());
  }
}

TEST(District, RefusesFewerObjectsThanOneBlockHas) {
  EXPECT_THROW(makeDistrict(100, 1), std::invalid_argument);
}

}  // namespace
}  // namespace enfilade::assets
