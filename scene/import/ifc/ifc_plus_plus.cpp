#include "scene/import/ifc/ifc_plus_plus.hpp"

#include "scene/import/worker/reader_module.hpp"

namespace enfilade::scene {

std::filesystem::path ifcPlusPlusModule() {
  return moduleFile("ifc_plus_plus.so", "ENFILADE_IFC_PLUS_PLUS", ENFILADE_IFC_PLUS_PLUS_MODULE);
}

void sendShapesByIfcPlusPlus(std::string text) {
  reinterpret_cast<SendShapes*>(openModule(ifcPlusPlusModule(), kSendShapes))(text);
}

}  // namespace enfilade::scene
