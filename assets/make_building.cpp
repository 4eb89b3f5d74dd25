// make_building: writes the bundled building as GLB with its sidecar, or a district as GLB.
#include <cstdio>
#include <filesystem>

#include "assets/building.hpp"
#include "assets/glb_writer.hpp"
#include "assets/maker.hpp"
#include "assets/sidecar_writer.hpp"

int main(int argc, char** argv) {
  using namespace enfilade;
  return assets::runMaker(
      argc, argv,
      "usage: make_building OUT [OBJECTS [SEED]]: the bundled building, or a district of exactly\n"
      "OBJECTS objects (at least 5000), as GLB",
      [](const assets::MakerArguments& arguments) {
        assets::BuildingOptions options;
        options.objects = arguments.number.value_or(options.objects);
        options.seed = arguments.seed.value_or(options.seed);
        std::vector<assets::MovingPart> movingParts;
        const scene::Model model = assets::makeBuilding(options, &movingParts);
        assets::writeGlb(arguments.file, model, movingParts);
        if (options.objects == 0)
          assets::writeSidecar(arguments.file, assets::makeSidecarText(model, movingParts));
        std::printf("%s: %zu objects, %zu meshes, %zu materials, %.1f MB\n", arguments.file.c_str(),
                    model.objects.size(), model.meshes.size(), model.materials.size(),
                    static_cast<double>(std::filesystem::file_size(arguments.file)) / 1e6);
      });
}
