#include "scene/import/ifc/ifc_plus_plus.hpp"

#include "scene/import/worker/reader_module.hpp"

namespace enfilade::scene {

std::filesystem::path findIfcPlusPlusModule() {
  return findModule("ifc_plus_plus.so", "ENFILADE_IFC_PLUS_PLUS", ENFILADE_IFC_PLUS_PLUS_MODULE);
}

void sendMeshesWithIfcPlusPlus(std::string text) {
  reinterpret_cast<SendMeshesFunction*>(openModule(findIfcPlusPlusModule(), kSendMeshesSymbol))(
      text);
}

}  // namespace enfilade::scene
