// meshopt's vertex codec: streams of both versions in all their modes, and damaged ones.
#include "scene/import/gltf/encoding/meshopt_vertices.hpp"

#include <gtest/gtest.h>

#include "scene/import/gltf/encoding/meshopt_view.hpp"
#include "tests/scene/encoded_gltf.hpp"
#include "tests/scene/meshopt_stream.hpp"

namespace enfilade::scene {
namespace {

/// Elements whose bytes change by nothing, a little or a lot.
std::string makeElements(std::size_t count, std::size_t stride, unsigned seed) {
  std::mt19937 random(seed);
  std::string bytes(count * stride, '\0');
  for (std::size_t i = 0; i < count; ++i)
    for (std::size_t k = 0; k < stride; ++k) {
      const int before = i == 0 ? 0 : bytes[(i - 1) * stride + k];
      const unsigned range = k % 3 == 0 ? 1 : k % 3 == 1 ? 5 : 200;
      bytes[i * stride + k] = static_cast<char>(before + static_cast<int>(random() % range));
    }
  return bytes;
}

/// "" or the decoder's error.
std::string findFailureOfStream(const std::string& stream, std::size_t count, std::size_t stride) {
  std::string bytes;
  return decodeMeshoptVertices(stream, count, stride, bytes);
}

TEST(MeshoptVertices, Version1DecodesAllModesOfPlanesGroupsAndChannels) {
  tests::MeshoptStream used;
  unsigned seed = 0;
  for (const std::size_t stride : {4u, 12u, 20u, 96u, 256u})
    for (const std::size_t count : {1u, 15u, 16u, 17u, 200u, 700u}) {
      const std::string elements = makeElements(count, stride, ++seed);
      const tests::MeshoptStream stream =
          tests::MeshoptStreamWriter(elements, stride, seed).write();
      std::string bytes;
      ASSERT_EQ(decodeMeshoptVertices(stream.bytes, count, stride, bytes), "");
      ASSERT_EQ(bytes, elements) << count << " elements of " << stride << " bytes";
      for (std::size_t i = 0; i < 4; ++i) {
        used.controls[i] += stream.controls[i];
        for (std::size_t c = 0; c < 2; ++c) used.headers[c][i] += stream.headers[c][i];
      }
      for (std::size_t i = 0; i < 3; ++i) used.channels[i] += stream.channels[i];
    }
  for (const unsigned times : used.controls) EXPECT_GT(times, 0u);
  for (const auto& headers : used.headers)
    for (const unsigned times : headers) EXPECT_GT(times, 0u);
  for (const unsigned times : used.channels) EXPECT_GT(times, 0u);
}

TEST(MeshoptVertices, Version0DecodesWhatTheLibraryEncodes) {
  for (const std::size_t stride : {4u, 12u, 256u})
    for (const std::size_t count : {1u, 17u, 700u}) {
      const std::string elements = makeElements(count, stride, 7);
      std::string bytes;
      ASSERT_EQ(decodeMeshoptVertices(tests::packVertices(elements, stride), count, stride, bytes),
                "");
      EXPECT_EQ(bytes, elements) << count << " elements of " << stride << " bytes";
    }
}

/// 20 elements of four rising bytes, two shorts and a float, by meshoptimizer 1.3. Its channels
/// have the modes 0, 2 with a rotation by 6, and 1.
constexpr std::string_view kStreamOfMeshoptimizer =
    "a155dd3a052aaaaaaaaa0000000204444444444444440f00040404040206666666666666660f000606060602088888"
    "88"
    "888888880f000808080801071c71c70307030f030600010700fa0e1a060a3e0a061a0e7a060a1e0a063a0e1a020013"
    "17"
    "131f1317130f0f00011f010300aff153b1d771d3b15ff153b1d771d3b16fd1b300bfc0201fbfc0c040b09078684c54"
    "4e"
    "32363a3e01c2017f7f8001000000000000000000000000000000ffff00000000006201";

std::string decodeHex(std::string_view digits) {
  std::string bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2)
    bytes += static_cast<char>(std::stoi(std::string(digits.substr(i, 2)), nullptr, 16));
  return bytes;
}

TEST(MeshoptVertices, AStreamOfMeshoptimizerDecodesToItsElements) {
  std::string elements;
  for (int i = 0; i < 20; ++i) {
    for (int k = 1; k <= 4; ++k) elements += static_cast<char>(i * k);
    elements += tests::toBytes(std::vector<std::uint16_t>{
        static_cast<std::uint16_t>(1000 * i), static_cast<std::uint16_t>(65535 - 700 * i)});
    elements += tests::toBytes(std::vector<float>{0.5f * static_cast<float>(i * i - 6 * i)});
  }
  std::string bytes;
  EXPECT_EQ(decodeMeshoptVertices(decodeHex(kStreamOfMeshoptimizer), 20, 12, bytes), "");
  EXPECT_EQ(bytes, elements);
}

TEST(MeshoptVertices, AStreamOfAnotherLengthOrVersionOrModeIsAnError) {
  const std::string stream = decodeHex(kStreamOfMeshoptimizer);
  for (std::size_t size = 0; size < stream.size(); ++size)
    EXPECT_NE(findFailureOfStream(stream.substr(0, size), 20, 12), "") << size;
  std::string longer = stream;
  longer.insert(stream.size() - 24, 3, '\0');
  EXPECT_EQ(findFailureOfStream(longer, 20, 12), "its compressed data has 3 bytes too many");
  for (const char channel : {'\x03', '\x10', '\x21', '\xff'}) {
    std::string unknown = stream;
    unknown.back() = channel;
    EXPECT_NE(findFailureOfStream(unknown, 20, 12).find("unknown mode"), std::string::npos);
  }
  std::string newer = stream;
  newer[0] = '\xa2';
  EXPECT_NE(findFailureOfStream(newer, 20, 12).find("compressed by version 2"), std::string::npos);
  EXPECT_EQ(findFailureOfStream("\xe1" + stream.substr(1), 20, 12),
            "its compressed data is not of the vertex codec");
}

TEST(MeshoptVertices, ACountThatTheStreamCannotContainAllocatesNothing) {
  for (const std::string& stream :
       {decodeHex(kStreamOfMeshoptimizer), tests::packVertices(makeElements(20, 12, 1), 12)})
    for (const std::size_t count : {std::size_t{100'000}, SIZE_MAX / 12, SIZE_MAX}) {
      std::string bytes;
      EXPECT_EQ(decodeMeshoptVertices(stream, count, 12, bytes),
                "its compressed data ends too early");
      EXPECT_TRUE(bytes.empty());
    }
  std::string bytes;
  for (const char* mode : {"TRIANGLES", "INDICES"})
    EXPECT_EQ(decodeMeshoptView({SIZE_MAX / 3 * 3, 4, mode, "NONE", "\xe1"}, bytes),
              "its compressed data ends too early");
}

}  // namespace
}  // namespace enfilade::scene
