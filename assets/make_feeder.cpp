// make_feeder: writes the bundled parts feeder as GLB with its sidecar.
#include <cstdio>

#include "assets/feeder.hpp"
#include "assets/glb_writer.hpp"
#include "assets/maker.hpp"
#include "assets/sidecar_writer.hpp"

int main(int argc, char** argv) {
  using namespace enfilade;
  return assets::runMaker(
      argc, argv,
      "usage: make_feeder OUT [PARTS [SEED]]: the bundled parts feeder as GLB, and its sidecar",
      [](const assets::MakerArguments& arguments) {
        assets::FeederOptions options;
        options.parts = arguments.number.value_or(options.parts);
        options.seed = arguments.seed.value_or(options.seed);
        assets::writeGlb(arguments.file, assets::makeFeeder(options));
        assets::writeSidecar(arguments.file, assets::makeFeederSidecar());
        std::printf("%s: a tray and %zu parts\n", arguments.file.c_str(), options.parts);
      });
}
