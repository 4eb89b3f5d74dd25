// The options that say which model to load and how: as texts from CLI11, and converted.
#pragma once

#include <string>
#include <vector>

#include "server/base/load_scene.hpp"

namespace CLI {
class App;
}

namespace enfilade::server {

struct ModelArguments {
  std::string file, unit, up, ifcReader = "auto", ifcDoors = "move", gltfScene;
  std::vector<double> offset;
  bool noCache = false, georeference = false, ignoreAppearance = false;
};

/// Lists the options that follow under this heading of --help.
void setGroup(CLI::App& verb, const char* heading);

/// Adds SCENE and the options with their validators. `into` must outlive `verb`.
void addModel(CLI::App& verb, ModelArguments& into);

ModelOptions makeModelOptions(const ModelArguments& read);

}  // namespace enfilade::server
