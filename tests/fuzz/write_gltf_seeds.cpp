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
      {"plain", tests::plainTerrace()},
      {"quantized", tests::quantizedTerrace(true)},
      {"meshopt", tests::meshoptTerrace({})},
      {"meshopt-sequence", tests::meshoptTerrace(Options{.fallback = true, .sequence = true})},
      {"meshopt-exponential", tests::meshoptTerrace(Options{.exponential = true})},
      {"meshopt-version1", tests::meshoptTerrace(Options{.version = 1})},
      {"draco", tests::dracoTerrace(10, false)},
      {"draco-sequential", tests::dracoTerrace(10, true)},
      {"sparse", tests::sparseTerrace(false)},
      {"strip", tests::stripTerrace()},
      {"instances", tests::instancedTerrace(true)},
      {"posed", tests::posedTerrace()}};
  for (const auto& [name, file] : seeds)
    std::ofstream(std::filesystem::path(argv[1]) / name, std::ios::binary) << file.glb();
  const std::string uri = "data:application/octet-stream;base64,";
  const tests::GltfWriter text = tests::quantizedTerrace(false);
  std::ofstream(std::filesystem::path(argv[1]) / "text", std::ios::binary)
      << text.gltf(uri + tests::base64(text.binary));
  return 0;
}
