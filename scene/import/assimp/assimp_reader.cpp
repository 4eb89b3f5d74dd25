#include "scene/import/assimp/assimp_reader.hpp"

#include "scene/import/worker/reader_module.hpp"

namespace enfilade::scene {

std::filesystem::path findAssimpModule() {
  return findModule("assimp_reader.so", "ENFILADE_ASSIMP", ENFILADE_ASSIMP_READER_MODULE);
}

AssimpOutput readWithAssimp(const AssimpInput& file) {
  AssimpOutput read;
  reinterpret_cast<AssimpReadFunction*>(openModule(findAssimpModule(), kAssimpReadSymbol))(file,
                                                                                           read);
  return read;
}

}  // namespace enfilade::scene
