// Writes the seeds of the glTF fuzz target, one file for each encoding, to the folder that its
// argument names: build/fuzz/write_gltf_seeds tests/fuzz/corpus/gltf
#include <filesystem>
#include <fstream>
#include <functional>

#include "tests/scene/encoded_gltf.hpp"

int main(int argc, char** argv) {
  if (argc != 2) return 2;
  namespace tests = enfilade::tests;
  using Options = tests::MeshoptOptions;
  const std::vector<std::pair<const char*, tests::GltfWriter>> seeds{
      {"plain", tests::makePlainTerrace()},
      {"quantized", tests::makeQuantizedTerrace(true)},
      {"meshopt", tests::makeMeshoptTerrace({})},
      {"meshopt-sequence", tests::makeMeshoptTerrace(Options{.fallback = true, .sequence = true})},
      {"meshopt-exponential", tests::makeMeshoptTerrace(Options{.exponential = true})},
      {"meshopt-version1", tests::makeMeshoptTerrace(Options{.version = 1})},
      {"draco", tests::makeDracoTerrace(10, false)},
      {"draco-sequential", tests::makeDracoTerrace(10, true)},
      {"sparse", tests::makeSparseTerrace(false)},
      {"strip", tests::makeStripTerrace()},
      {"instances", tests::makeInstancedTerrace(true)},
      {"posed", tests::makePosedTerrace()}};
  for (const auto& [name, file] : seeds)
    std::ofstream(std::filesystem::path(argv[1]) / name, std::ios::binary) << file.toGlb();
  const std::string uri = "data:application/octet-stream;base64,";
  const tests::GltfWriter text = tests::makeQuantizedTerrace(false);
  std::ofstream(std::filesystem::path(argv[1]) / "text", std::ios::binary)
      << text.toGltf(uri + tests::encodeBase64(text.binary));
  return 0;
}
