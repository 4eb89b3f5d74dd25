// make_building: writes the bundled building as GLB with its sidecar, or a district as GLB.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "assets/building.hpp"
#include "assets/glb_writer.hpp"
#include "assets/sidecar_writer.hpp"

int main(int argc, char** argv) {
  using namespace enfilade;
  assets::BuildingOptions options;
  std::string file;
  CLI::App app{"Writes the bundled building as GLB"};
  app.add_option("--objects", options.objects,
                 "a district of exactly N objects (at least 5000); default: one building");
  app.add_option("--seed", options.seed, "seed of the building")->capture_default_str();
  app.add_option("OUT", file, "the GLB file to write")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    std::vector<assets::MovingPart> movingParts;
    const scene::Model model = assets::makeBuilding(options, &movingParts);
    assets::writeGlb(file, model, movingParts);
    if (options.objects == 0) assets::writeSidecarOf(file, assets::sidecarText(model, movingParts));
    std::printf("%s: %zu objects, %zu meshes, %zu materials, %.1f MB\n", file.c_str(),
                model.objects.size(), model.meshes.size(), model.materials.size(),
                static_cast<double>(std::filesystem::file_size(file)) / 1e6);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "make_building: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_building: %s\n", error.what());
    return 1;
  }
}
