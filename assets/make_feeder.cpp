// make_feeder: writes the bundled parts feeder as GLB with its sidecar.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "assets/feeder.hpp"
#include "assets/glb_writer.hpp"
#include "assets/sidecar_writer.hpp"

int main(int argc, char** argv) {
  using namespace enfilade;
  assets::FeederOptions options;
  std::filesystem::path file;
  CLI::App app{"Writes the bundled parts feeder as GLB, and its sidecar next to it"};
  app.add_option("--parts", options.parts, "number of parts")->capture_default_str();
  app.add_option("--seed", options.seed, "seed of the parts' rotations")->capture_default_str();
  app.add_option("OUT", file, "the GLB file to write")->required();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  try {
    assets::writeGlb(file, assets::makeFeeder(options));
    assets::writeSidecarOf(file, assets::feederSidecar());
    std::printf("%s: a tray and %zu parts\n", file.c_str(), options.parts);
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "make_feeder: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "make_feeder: %s\n", error.what());
    return 1;
  }
}
