#include "scene/import/assimp/assimp_reader.hpp"

#include "scene/import/worker/reader_module.hpp"

namespace enfilade::scene {

std::filesystem::path assimpModule() {
  return moduleFile("assimp_reader.so", "ENFILADE_ASSIMP", ENFILADE_ASSIMP_READER_MODULE);
}

FileRead readByAssimp(const FileToRead& file) {
  FileRead read;
  reinterpret_cast<ReadByAssimp*>(openModule(assimpModule(), kReadByAssimp))(file, read);
  return read;
}

}  // namespace enfilade::scene
