// PLY, STL and zipped COLLADA: the same triangles in every encoding, errors for damaged files, and
// the up axis that is guessed.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <functional>

#include "scene/import/import_model.hpp"
#include "scene/world/data/scene.hpp"
#include "tests/scene/hand_made_files.hpp"
#include "tests/scene/import_outcome.hpp"
#include "tests/scene/stored_zip.hpp"

namespace enfilade::scene {
namespace {

using tests::BoxMesh;
using tests::TemporaryFolder;

/// Bytes of numbers in either byte order.
class NumberWriter {
 public:
  explicit NumberWriter(bool bigEndian) : bigEndian_(bigEndian) {}
  template <class Value>
  NumberWriter& add(Value value) {
    std::string bytes(reinterpret_cast<const char*>(&value), sizeof value);
    if (bigEndian_) std::reverse(bytes.begin(), bytes.end());
    text += bytes;
    return *this;
  }
  std::string text;

 private:
  bool bigEndian_;
};

/// A room of 8 x 6 m, 3 m high, z up: its box seen from outside.
BoxMesh makeRoom() {
  return BoxMesh({8, 6, 3});
}

constexpr char kVertexHeader[] =
    "element vertex 8\nproperty float x\nproperty double y\nproperty float z\n"
    "property uchar red\nproperty uchar green\nproperty uchar blue\n";

std::string makeTextPly(const BoxMesh& box) {
  std::string text = "ply\nformat ascii 1.0\ncomment by hand\n" + std::string(kVertexHeader) +
                     "element face 12\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& p : box.positions)
    text += std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) +
            " 255 0 0\n";
  for (std::size_t i = 0; i < box.indices.size(); i += 3)
    text += "3 " + std::to_string(box.indices[i]) + " " + std::to_string(box.indices[i + 1]) + " " +
            std::to_string(box.indices[i + 2]) + "\n";
  return text;
}

/// With a list per vertex and an element that the import skips.
std::string makeBinaryPly(const BoxMesh& box, bool bigEndian) {
  NumberWriter body(bigEndian);
  for (const auto& p : box.positions) {
    body.add(p[0]).add(static_cast<double>(p[1])).add(p[2]);
    for (const int channel : {255, 0, 0}) body.add(static_cast<std::uint8_t>(channel));
    body.add(std::uint8_t{2}).add(std::int16_t{7}).add(std::int16_t{8});
  }
  for (int i = 0; i < 3; ++i) body.add(static_cast<double>(i));
  for (std::size_t i = 0; i < box.indices.size(); i += 3) {
    body.add(std::uint8_t{3});
    for (std::size_t k = 0; k < 3; ++k) body.add(static_cast<std::uint32_t>(box.indices[i + k]));
    body.add(1.0f);
  }
  return "ply\nformat binary_" + std::string(bigEndian ? "big" : "little") + "_endian 1.0\n" +
         kVertexHeader +
         "property list uchar short other\nelement camera 3\nproperty double focus\n"
         "element face 12\nproperty list uchar uint vertex_index\nproperty float quality\n"
         "end_header\n" +
         body.text;
}

/// Six quads and no triangle, listed before the vertices.
std::string makePolygonPly(const BoxMesh& box) {
  std::string text =
      "ply\nformat ascii 1.0\nelement face 6\nproperty list uchar int vertex_indices\n"
      "element vertex 8\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
      "4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";
  for (const auto& p : box.positions)
    text += std::to_string(p[0]) + " " + std::to_string(p[1]) + " " + std::to_string(p[2]) + "\n";
  return text;
}

std::string makeTextStl(const BoxMesh& box) {
  std::string text = "solid room\n";
  for (std::size_t i = 0; i < box.indices.size(); i += 3) {
    text += " facet normal 0 0 0\n  outer loop\n";
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& p = box.positions[box.indices[i + k]];
      text += "   vertex " + std::to_string(p[0]) + " " + std::to_string(p[1]) + " " +
              std::to_string(p[2]) + "\n";
    }
    text += "  endloop\n endfacet\n";
  }
  return text + "endsolid room\n";
}

/// Its header begins like a text file, as those of some programs do.
std::string makeBinaryStl(const BoxMesh& box) {
  NumberWriter body(false);
  body.add(static_cast<std::uint32_t>(box.indices.size() / 3));
  for (std::size_t i = 0; i < box.indices.size(); i += 3) {
    for (int axis = 0; axis < 3; ++axis) body.add(0.0f);
    for (std::size_t k = 0; k < 3; ++k)
      for (const float v : box.positions[box.indices[i + k]]) body.add(v);
    body.add(std::uint16_t{0});
  }
  std::string header = "solid exported";
  header.resize(80, ' ');
  return header + body.text;
}

struct ScanFile {
  const char* name;
  const char* file;
  std::function<std::string(const BoxMesh&)> make;
  bool coloured = false;
};

void PrintTo(const ScanFile& scan, std::ostream* to) {
  *to << scan.name;
}

class ScanFiles : public ::testing::TestWithParam<ScanFile> {};

TEST_P(ScanFiles, GiveTheBoxWithItsUpAxis) {
  const TemporaryFolder folder;
  const Model model = importModel(folder.write(GetParam().file, GetParam().make(makeRoom())));
  ASSERT_EQ(model.objects.size(), 1u);
  EXPECT_EQ(model.upAxis, UpAxis::z);
  EXPECT_EQ(countDiagnostics(model, "guessed_up_axis"), 1u);
  EXPECT_EQ(countDiagnostics(model, "no_unit"), 1u);
  EXPECT_EQ(model.meshes.at(0).positions.size(), 8u);
  EXPECT_EQ(model.meshes[0].triangleCount(), 12u);
  EXPECT_EQ(countDiagnostics(model, "vertex_colours_ignored"), 0u);
  EXPECT_EQ(model.meshes[0].colours,
            std::vector<VertexColour>(GetParam().coloured ? 8 : 0, {255, 0, 0, 255}));
  const Scene scene{Model(model)};
  EXPECT_LT((scene.bounds().size() - Vec3(8, 3, 6)).norm(), 1e-9);
  // The winding is kept: the surface bounds the room's volume.
  double volume = 0;
  const Mesh& mesh = model.meshes[0];
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]].cast<double>();
    const Vec3 b = mesh.positions[mesh.indices[i + 1]].cast<double>();
    volume += a.dot(b.cross(mesh.positions[mesh.indices[i + 2]].cast<double>())) / 6;
  }
  EXPECT_NEAR(volume, 8 * 6 * 3, 1e-9);
}

TEST_P(ScanFiles, CutOffOrDamagedAnywhereLoadOrAreErrorsThatNameTheFile) {
  const TemporaryFolder folder;
  const std::string whole = GetParam().make(makeRoom());
  const std::string name = std::string("damaged") + GetParam().file;
  for (std::size_t at = 1; at < whole.size(); at += 1 + whole.size() / 12) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(~damaged[at]);
    for (const std::string& content : {damaged, whole.substr(0, at)}) {
      const std::string text = catchFailure(folder.write(name, content));
      EXPECT_TRUE(text.empty() || text.find(name) != std::string::npos) << text;
    }
  }
  EXPECT_NE(catchFailure(folder.write(name, whole.substr(0, whole.size() * 2 / 3))), "");
}

std::string nameScan(const ::testing::TestParamInfo<ScanFile>& scan) {
  return scan.param.name;
}

INSTANTIATE_TEST_SUITE_P(
    Room, ScanFiles,
    ::testing::Values(ScanFile{"TextPly", "a.ply", makeTextPly, true},
                      ScanFile{"LittleEndianPly", "a.ply",
                               [](const BoxMesh& box) { return makeBinaryPly(box, false); }, true},
                      ScanFile{"BigEndianPly", "a.ply",
                               [](const BoxMesh& box) { return makeBinaryPly(box, true); }, true},
                      ScanFile{"PolygonsBeforeVertices", "a.ply", makePolygonPly},
                      ScanFile{"TextStl", "a.stl", makeTextStl},
                      ScanFile{"TextStlInCapitals", "a.stl",
                               [](const BoxMesh& box) {
                                 std::string text = makeTextStl(box);
                                 std::ranges::transform(text, text.begin(), [](char c) {
                                   return static_cast<char>(std::toupper(c));
                                 });
                                 return text;
                               }},
                      ScanFile{"BinaryStl", "a.STL", makeBinaryStl}),
    nameScan);

TEST(ScanUpAxis, IsThatOfTheLargestLevelAreaAndCanBeSet) {
  const TemporaryFolder folder;
  const auto importBox = [&](std::array<float, 3> size, std::optional<UpAxis> up = {}) {
    ImportOptions options;
    options.up = up;
    return importModel(folder.write("a.stl", makeBinaryStl(BoxMesh(size))), options);
  };
  EXPECT_EQ(importBox({8, 3, 6}).upAxis, UpAxis::y);
  EXPECT_EQ(importBox({3, 8, 6}).upAxis, UpAxis::x);
  EXPECT_EQ(importBox({5, 5, 5}).upAxis, UpAxis::z);
  EXPECT_EQ(findDiagnosticText(importBox({8, 3, 6}), "guessed_up_axis"),
            "y is up: the largest levels across x, y, z have 18 48 24 of 180 square units; --up "
            "sets another");
  const Model cube = importBox({5, 5, 5});
  EXPECT_EQ(countDiagnostics(cube, "unclear_up_axis"), 1u);
  EXPECT_EQ(countDiagnostics(cube, "guessed_up_axis"), 0u);
  const Model set = importBox({8, 3, 6}, UpAxis::z);
  EXPECT_EQ(set.upAxis, UpAxis::z);
  EXPECT_EQ(countDiagnostics(set, "guessed_up_axis"), 0u);
}

/// A room of 6 x 5 x 2.7 m without a ceiling, with its floor across `up`.
std::string makeOpenRoom(std::size_t up) {
  std::string text =
      "ply\nformat ascii 1.0\ncomment TextureFile room.png\nelement vertex 8\nproperty float x\n"
      "property float y\nproperty float z\nelement face 5\nproperty list uchar int vertex_indices\n"
      "end_header\n";
  const std::array<double, 3> size{6, 5, 2.7};
  for (int corner = 0; corner < 8; ++corner) {
    std::array<double, 3> p{};
    for (std::size_t k = 0; k < 3; ++k) p[(up + 1 + k) % 3] = (corner >> k & 1) * size[k];
    for (const double x : p) text += std::to_string(x) + " ";
    text += "\n";
  }
  return text + "4 0 1 3 2\n4 0 1 5 4\n4 2 3 7 6\n4 0 2 6 4\n4 1 3 7 5\n";
}

TEST(ScanUpAxis, IsThatOfTheFloorOfARoomWithoutACeiling) {
  const TemporaryFolder folder;
  for (std::size_t up = 0; up < 3; ++up) {
    const Model model = importModel(folder.write("room.ply", makeOpenRoom(up)));
    EXPECT_EQ(model.upAxis, static_cast<UpAxis>(up));
    EXPECT_EQ(countDiagnostics(model, "guessed_up_axis"), 1u);
    EXPECT_EQ(findDiagnosticText(model, "missing_texture"),
              "room.png: textures of PLY are not read");
  }
}

/// The floor and walls of a room, from within, with its floor across `up`, and turned about x.
std::string makeRoomSeenFromWithin(UpAxis up, double tilt) {
  BoxMesh room(up == UpAxis::z || up == UpAxis::minusZ ? std::array<float, 3>{6, 5, 2.7f}
                                                       : std::array<float, 3>{6, 2.7f, 5});
  const std::size_t axis = up == UpAxis::z || up == UpAxis::minusZ ? 2 : 1;
  const bool isDown = up == UpAxis::minusY || up == UpAxis::minusZ;
  std::string text =
      "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
      "property float z\nelement face 10\nproperty list uchar int vertex_indices\nend_header\n";
  double low = 1e9, high = -1e9;
  for (const auto& p : room.positions)
    low = std::min<double>(low, p[axis]), high = std::max<double>(high, p[axis]);
  const double ceiling = isDown ? low : high;
  const double cosine = std::cos(tilt), sine = std::sin(tilt);
  for (const auto& p : room.positions)
    text += std::to_string(p[0]) + " " + std::to_string(cosine * p[1] - sine * p[2]) + " " +
            std::to_string(sine * p[1] + cosine * p[2]) + "\n";
  for (std::size_t i = 0; i + 2 < room.indices.size(); i += 3) {
    const auto isAtCeiling = [&](std::size_t k) {
      return room.positions[room.indices[i + k]][axis] == ceiling;
    };
    if (isAtCeiling(0) && isAtCeiling(1) && isAtCeiling(2)) continue;
    for (const std::size_t k : {0u, 2u, 1u})
      text += (k == 0 ? "3 " : " ") + std::to_string(room.indices[i + k]);
    text += "\n";
  }
  return text;
}

TEST(ScanUpAxis, AFloorThatHangsIsReportedAndCanBeTurned) {
  const TemporaryFolder folder;
  for (const UpAxis up : {UpAxis::minusZ, UpAxis::minusY}) {
    const auto file = folder.write("room.ply", makeRoomSeenFromWithin(up, 0));
    const std::string text = findDiagnosticText(importModel(file), "unclear_up_axis");
    EXPECT_NE(text.find("--up=" + toString(up)), std::string::npos) << text;
    ImportOptions options;
    options.up = up;
    const Model model = importModel(file, options);
    EXPECT_EQ(countDiagnostics(model, "unclear_up_axis"), 0u);
    // The floor has no triangle above it: the lowest level is the large one, and faces up.
    double floor = 0;
    const Mesh& mesh = model.meshes.at(0);
    const double lowest = Scene(Model(model)).bounds().min.y();
    for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
      std::array<Vec3, 3> p;
      for (std::size_t k = 0; k < 3; ++k)
        p[k] = computeWorldPosition(model.objects.at(0), mesh, mesh.indices[i + k]);
      const Vec3 area = (p[1] - p[0]).cross(p[2] - p[0]) / 2;
      if (std::abs(p[0].y() - lowest) + std::abs(p[1].y() - lowest) + std::abs(p[2].y() - lowest) <
          1e-5)
        floor += area.y();
    }
    EXPECT_NEAR(floor, 30, 1e-3);
  }
  const Model upright = importModel(folder.write("up.ply", makeRoomSeenFromWithin(UpAxis::z, 0)));
  EXPECT_EQ(countDiagnostics(upright, "guessed_up_axis"), 1u);
}

TEST(ScanUpAxis, ATiltedRoomIsUnclear) {
  const TemporaryFolder folder;
  const auto tilted = [&](double degrees) {
    return importModel(
        folder.write("t.ply", makeRoomSeenFromWithin(UpAxis::z, degrees * 0.0174533)));
  };
  EXPECT_EQ(countDiagnostics(tilted(5), "guessed_up_axis"), 1u);
  EXPECT_EQ(countDiagnostics(tilted(15), "unclear_up_axis"), 1u);
}

TEST(ScanPly, LinesMayEndInCarriageReturnsAlone) {
  const TemporaryFolder folder;
  std::string text = makeTextPly(makeRoom());
  std::ranges::replace(text, '\n', '\r');
  // The first byte of the data is a line feed, which belongs to it.
  BoxMesh room = makeRoom();
  std::memcpy(room.positions[0].data(), "\n\0\0\0", 4);
  std::string binary = makeBinaryPly(room, false);
  const std::size_t header = binary.find("end_header\n") + 11;
  std::replace(binary.begin(), binary.begin() + static_cast<std::ptrdiff_t>(header), '\n', '\r');
  for (const std::string& file : {text, binary}) {
    const Model model = importModel(folder.write("a.ply", file));
    EXPECT_EQ(model.meshes.at(0).triangleCount(), 12u);
    EXPECT_LT((Scene(Model(model)).bounds().size() - Vec3(8, 3, 6)).norm(), 1e-9);
  }
}

TEST(ScanPly, APointCloudIsRefusedInWords) {
  const TemporaryFolder folder;
  const std::string text = catchFailure(
      folder.write("cloud.ply",
                   "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\n"
                   "property float z\nend_header\n0 0 0\n1 1 1\n"));
  EXPECT_NE(text.find("a point cloud without faces"), std::string::npos) << text;
  EXPECT_NE(text.find("mesh it first"), std::string::npos) << text;
}

TEST(ScanPly, TwoVertexElementsAreRefused) {
  const TemporaryFolder folder;
  const std::string vertices =
      "element vertex 1\nproperty float x\nproperty float y\n"
      "property float z\n";
  const std::string text = catchFailure(folder.write(
      "two.ply", "ply\nformat ascii 1.0\n" + vertices + vertices + "end_header\n0 0 0\n1 1 1\n"));
  EXPECT_NE(text.find("two elements 'vertex'"), std::string::npos) << text;
}

TEST(ScanPly, ConcavePolygonsAreCutWithinTheirOutline) {
  const TemporaryFolder folder;
  // An L of 3 square metres; a fan from its first corner would cover the notch.
  const Model model = importModel(
      folder.write("l.ply",
                   "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\n"
                   "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
                   "end_header\n2 0 0\n2 1 0\n1 1 0\n1 2 0\n0 2 0\n0 0 0\n6 0 1 2 3 4 5\n"));
  const Mesh& mesh = model.meshes.at(0);
  ASSERT_EQ(mesh.triangleCount(), 4u);
  double area = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const Vec3 a = mesh.positions[mesh.indices[i]].cast<double>();
    const Vec3 b = mesh.positions[mesh.indices[i + 1]].cast<double>();
    const Vec3 c = mesh.positions[mesh.indices[i + 2]].cast<double>();
    const double z = (b - a).cross(c - a).z() / 2;
    EXPECT_GT(z, 0);
    area += z;
  }
  EXPECT_DOUBLE_EQ(area, 3);
}

TEST(ScanPly, StripsAreUnrolled) {
  const TemporaryFolder folder;
  const Model model = importModel(
      folder.write("s.ply",
                   "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n"
                   "property float z\nelement tristrips 1\nproperty list int int vertex_indices\n"
                   "end_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n8 0 1 2 3 -1 0 1 3\n"));
  EXPECT_EQ(model.meshes.at(0).indices, (std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2, 0, 1, 3}));
}

TEST(ScanPly, MapCoordinatesKeepMillimetres) {
  const TemporaryFolder folder;
  const Model model = importModel(
      folder.write("map.ply",
                   "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\n"
                   "property double z\nelement face 1\nproperty list uchar int vertex_indices\n"
                   "end_header\n5400000.001 400000 10\n5400001 400000 10\n5400000 400001 10\n"
                   "3 0 1 2\n"));
  EXPECT_EQ(model.offset.x(), 5400001);
  const Scene scene{Model(model)};
  EXPECT_NEAR(computeWorldPosition(model.objects[0], model.meshes[0], 0).x(), -0.999, 1e-6);
}

// ---- colours of faces ---------------------------------------------------------------------------

struct ColouredFace {
  std::vector<std::uint32_t> corners;
  std::array<double, 3> colour;
};

/// A red quad, a green one and a red triangle in a row; neighbours have a common edge.
struct ColouredStrip {
  std::array<std::array<float, 3>, 7> positions{
      {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}, {3, 0, 0}}};
  std::array<ColouredFace, 3> faces{
      {{{0, 1, 4, 3}, {1, 0, 0}}, {{1, 2, 5, 4}, {0, 0.50196, 0}}, {{2, 6, 5}, {1, 0, 0}}}};

  std::string makeHeader(const std::string& format, const std::string& type,
                         const std::string& vertexProperties = "") const {
    std::string text = "ply\nformat " + format + " 1.0\nelement vertex 7\n";
    for (const char* axis : {"x", "y", "z"}) text += std::string("property float ") + axis + "\n";
    text += vertexProperties + "element face 3\nproperty list uchar int vertex_indices\n";
    for (const char* name : {"red", "green", "blue"})
      text += "property " + type + " " + name + "\n";
    return text + "end_header\n";
  }
};

template <class Channel>
std::string makeColouredBinaryPly(const std::string& type, double full, bool bigEndian) {
  const ColouredStrip strip;
  NumberWriter body(bigEndian);
  for (const auto& p : strip.positions) body.add(p[0]).add(p[1]).add(p[2]);
  for (const ColouredFace& face : strip.faces) {
    body.add(static_cast<std::uint8_t>(face.corners.size()));
    for (const std::uint32_t corner : face.corners) body.add(static_cast<std::int32_t>(corner));
    for (const double channel : face.colour)
      body.add(static_cast<Channel>(full > 1 ? channel * full + 0.5 : channel));
  }
  return strip.makeHeader(bigEndian ? "binary_big_endian" : "binary_little_endian", type) +
         body.text;
}

std::string makeColouredTextPly(const std::string& type, double full) {
  const ColouredStrip strip;
  std::string text = strip.makeHeader("ascii", type);
  for (const auto& p : strip.positions)
    for (const float v : p) text += std::to_string(v) + " ";
  for (const ColouredFace& face : strip.faces) {
    text += "\n" + std::to_string(face.corners.size());
    for (const std::uint32_t corner : face.corners) text += " " + std::to_string(corner);
    for (const double channel : face.colour)
      text +=
          " " + (full > 1 ? std::to_string(std::lround(channel * full)) : std::to_string(channel));
  }
  return text + "\n";
}

TEST(ScanColours, OfFacesSplitTheVerticesWhereTheyDiffer) {
  const TemporaryFolder folder;
  const VertexColour red{255, 0, 0, 255}, green{0, 128, 0, 255};
  for (const std::string& text :
       {makeColouredTextPly("uchar", 255), makeColouredTextPly("float", 1),
        makeColouredTextPly("float", 255), makeColouredBinaryPly<std::uint8_t>("uchar", 255, false),
        makeColouredBinaryPly<std::uint8_t>("uchar", 255, true),
        makeColouredBinaryPly<std::uint16_t>("ushort", 65535, true),
        makeColouredBinaryPly<float>("float", 1, false),
        makeColouredBinaryPly<float>("float", 1, true)}) {
    SCOPED_TRACE(text.substr(0, 30));
    const Model model = importModel(folder.write("a.ply", text));
    EXPECT_EQ(countDiagnostics(model, "vertex_colours_ignored"), 0u);
    EXPECT_EQ(model.materials.at(0).baseColour, Eigen::Vector4f(1, 1, 1, 1));
    const Mesh& mesh = model.meshes.at(0);
    ASSERT_EQ(mesh.triangleCount(), 5u);
    EXPECT_EQ(mesh.positions.size(), 7u + 4);  // 1, 4, 2 and 5 have both colours
    ASSERT_EQ(mesh.colours.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      const std::size_t triangle = i / 3;
      EXPECT_EQ(mesh.colours[mesh.indices[i]], triangle == 2 || triangle == 3 ? green : red) << i;
    }
    // The winding and the places are kept: 2.5 square metres, seen from +z.
    double area = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      const Eigen::Vector3f& a = mesh.positions[mesh.indices[i]];
      const Eigen::Vector3f b = mesh.positions[mesh.indices[i + 1]] - a;
      area += static_cast<double>(b.cross(mesh.positions[mesh.indices[i + 2]] - a).z()) / 2;
    }
    EXPECT_DOUBLE_EQ(area, 2.5);
  }
}

TEST(ScanColours, OfVerticesArePreferredToThoseOfFaces) {
  const TemporaryFolder folder;
  const ColouredStrip strip;
  std::string text = strip.makeHeader(
      "ascii", "uchar", "property uchar red\nproperty uchar green\nproperty uchar blue\n");
  for (const auto& p : strip.positions)
    text += std::to_string(p[0]) + " " + std::to_string(p[1]) + " 0 0 0 255\n";
  text += "4 0 1 4 3 255 0 0\n4 1 2 5 4 0 128 0\n3 2 6 5 255 0 0\n";
  const Model model = importModel(folder.write("both.ply", text));
  EXPECT_EQ(model.meshes.at(0).colours, std::vector<VertexColour>(7, {0, 0, 255, 255}));
  EXPECT_EQ(findDiagnosticText(model, "vertex_colours_ignored"),
            "mesh: those of its faces, because its vertices have colours, too");
}

TEST(ScanColours, FloatsCountTo255IfOneIsAboveOneAndMayHaveShortNames) {
  const TemporaryFolder folder;
  const auto readColours = [&](const std::string& first, const std::string& last) {
    const std::string text =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
        "property float z\nproperty float r\nproperty float g\nproperty float b\n"
        "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0 " +
        first + "\n1 0 0 " + first + "\n0 1 0 " + last + "\n3 0 1 2\n";
    return importModel(folder.write("a.ply", text)).meshes.at(0).colours;
  };
  const VertexColour dark{0, 1, 0, 255};
  EXPECT_EQ(readColours("0 1 0.2", "128 64 255"),
            (std::vector<VertexColour>{dark, dark, {128, 64, 255, 255}}));
  const VertexColour bright{0, 255, 51, 255};
  EXPECT_EQ(readColours("0 1 0.2", "1.0005 0 0"),
            (std::vector<VertexColour>{bright, bright, {255, 0, 0, 255}}));
}

TEST(ScanColours, OfStlFacetsAreReported) {
  const TemporaryFolder folder;
  const std::string plain = makeBinaryStl(makeRoom());
  EXPECT_EQ(countDiagnostics(importModel(folder.write("a.stl", plain)), "vertex_colours_ignored"),
            0u);
  std::string magics = plain, visCam = plain;
  magics.replace(20, 6, "COLOR=");
  visCam[plain.size() - 1] = '\x80';
  for (const std::string& text : {magics, visCam})
    EXPECT_EQ(countDiagnostics(importModel(folder.write("a.stl", text)), "vertex_colours_ignored"),
              1u);
}

TEST(ScanSizes, DataAfterWhatTheHeaderAnnouncesIsReported) {
  const TemporaryFolder folder;
  const auto trailing = [&](const char* name, const std::string& text) {
    return findDiagnosticText(importModel(folder.write(name, text)), "trailing_data");
  };
  std::string stl = makeBinaryStl(makeRoom());
  stl[80] = 11;
  EXPECT_EQ(trailing("less.stl", stl).find("mesh: "), 0u);
  const std::string text = makeTextPly(makeRoom());
  EXPECT_NE(trailing("more.ply", text + "3 0 1 2\n"), "");
  EXPECT_NE(trailing("more.ply", makeBinaryPly(makeRoom(), true) + "\1"), "");
  EXPECT_EQ(trailing("blank.ply", text + " \n\n"), "");
  EXPECT_EQ(trailing("filled.ply", makeBinaryPly(makeRoom(), false) + std::string("\n\0\0", 3)),
            "");
}

TEST(ScanStl, TextMayBeginWithAByteOrderMarkOrABlankLine) {
  const TemporaryFolder folder;
  for (const char* start : {"\xEF\xBB\xBF", "\r\n", "\xEF\xBB\xBF\n "}) {
    const Model model = importModel(folder.write("a.stl", start + makeTextStl(makeRoom())));
    ASSERT_EQ(model.objects.size(), 1u);
    EXPECT_EQ(model.objects[0].path, "room");
    EXPECT_EQ(model.meshes.at(0).triangleCount(), 12u);
  }
}

TEST(ScanStl, ABinaryFileMayBeginWithSolidAndHaveDataBehind) {
  const TemporaryFolder folder;
  const Model model =
      importModel(folder.write("a.stl", makeBinaryStl(makeRoom()) + "made by a program"));
  EXPECT_EQ(model.meshes.at(0).triangleCount(), 12u);
  EXPECT_EQ(countDiagnostics(model, "trailing_data"), 1u);
}

TEST(ScanSizes, ACountThatTheFileCannotHoldIsRefused) {
  const TemporaryFolder folder;
  for (const char* format : {"ascii", "binary_little_endian", "binary_big_endian"}) {
    const std::string text = catchFailure(folder.write(
        "a.ply", std::string("ply\nformat ") + format +
                     " 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
                     "property float z\nend_header\n0 0 0\n"));
    EXPECT_NE(text.find("announces 4000000000 elements 'vertex'"), std::string::npos) << text;
  }
  std::string stl =
      makeBinaryStl(makeRoom()).replace(0, 5, "other").replace(80, 4, "\xff\xff\xff\xff");
  const std::string text = catchFailure(folder.write("a.stl", stl));
  EXPECT_NE(text.find("4294967295 triangles announced"), std::string::npos) << text;
}

TEST(StlFile, AFileThatIsNoStlIsRefusedAsSuch) {
  const TemporaryFolder folder;
  const std::string text = catchFailure(folder.write("a.stl", "hello world\n"));
  EXPECT_NE(text.find("neither text, which begins with 'solid', nor binary: 12 bytes"),
            std::string::npos)
      << text;
}

// ---- zipped COLLADA -----------------------------------------------------------------------------

constexpr char kTriangleDae[] =
    R"(<?xml version="1.0"?><COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" )"
    R"(version="1.4.1"><asset><unit meter="0.01" name="cm"/><up_axis>Z_UP</up_axis></asset>)"
    R"(<library_geometries><geometry id="g" name="g"><mesh><source id="p"><float_array id="pa" )"
    R"(count="9">0 0 0 100 0 0 0 200 0</float_array><technique_common><accessor source="#pa" )"
    R"(count="3" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>)"
    R"(<param name="Z" type="float"/></accessor></technique_common></source><vertices id="v">)"
    R"(<input semantic="POSITION" source="#p"/></vertices><triangles count="1"><input )"
    R"(semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry>)"
    R"(</library_geometries><library_visual_scenes><visual_scene id="s"><node id="n" name="part">)"
    R"(<instance_geometry url="#g"/></node></visual_scene></library_visual_scenes><scene>)"
    R"(<instance_visual_scene url="#s"/></scene></COLLADA>)";

TEST(ZippedCollada, IsTheSameAsTheDocument) {
  const TemporaryFolder folder;
  std::string blank = kTriangleDae;  // one that is repaired
  blank.replace(blank.find(">0 0 0 100"), 1, ">  ");
  for (const std::string& document : {std::string(kTriangleDae), blank}) {
    const Model plain = importModel(folder.write("a.dae", document));
    const Model zipped =
        importModel(folder.write("a.zae", tests::makeStoredZip({{"model.dae", document}})));
    ASSERT_EQ(zipped.objects.size(), 1u);
    EXPECT_EQ(zipped.objects[0].path, plain.objects.at(0).path);
    EXPECT_EQ(zipped.metresPerUnit, 0.01);
    EXPECT_EQ(zipped.upAxis, UpAxis::z);
    EXPECT_LT((Scene(Model(zipped)).bounds().size() - Vec3(1, 0, 2)).norm(), 1e-6);
  }
}

TEST(ZippedCollada, WithoutADocumentOrDamagedIsAnError) {
  const TemporaryFolder folder;
  const std::string other =
      catchFailure(folder.write("a.zae", tests::makeStoredZip({{"readme.txt", "hello"}})));
  EXPECT_NE(other.find("contains no .dae file"), std::string::npos) << other;
  const std::string damaged = catchFailure(folder.write("b.zae", "PK\3\4 and no more"));
  EXPECT_NE(damaged.find("b.zae: cannot be unzipped"), std::string::npos) << damaged;
}

TEST(ZippedCollada, AllFilesTogetherMayTakeAnEighthOfTheMemoryLimit) {
  const TemporaryFolder folder;
  ImportOptions options;
  options.memoryLimit = std::size_t{256} << 20;
  const std::string half(std::size_t{17} << 20, ' ');
  const auto fits =
      folder.write("fits.zae", tests::makeStoredZip({{"a.dae", kTriangleDae + half}}));
  EXPECT_EQ(importModel(fits, options).objects.size(), 1u);
  const auto large = folder.write(
      "large.zae",
      tests::makeStoredZip({{"a.dae", kTriangleDae}, {"a.png", half}, {"b.png", half}}));
  const std::string text = catchFailure(large, options);
  EXPECT_NE(text.find("large.zae: unpacks to more than the 32 MiB allowed"), std::string::npos)
      << text;
}

}  // namespace
}  // namespace enfilade::scene
