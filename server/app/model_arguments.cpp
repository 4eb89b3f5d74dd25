#include "server/app/model_arguments.hpp"

#include <CLI/CLI.hpp>

#include "server/app/validators.hpp"

namespace enfilade::server {
namespace {

std::string validateUnit(const std::string& text) {
  if (scene::parseMetresPerUnit(text)) return {};
  return text + ": give m, mm, cm, ft, in or a positive number of metres";
}

}  // namespace

void setGroup(CLI::App& verb, const char* heading) {
  verb.option_defaults()->group(heading);
}

void addModel(CLI::App& verb, ModelArguments& into) {
  setGroup(verb, "Model");
  verb.add_option("SCENE", into.file, "Model file: glTF, GLB, OBJ, COLLADA, FBX, IFC, PLY or STL")
      ->required();
  verb.add_option("--unit", into.unit, "Unit of the file: m, mm, cm, ft, in or a number of metres")
      ->check(CLI::Validator(validateUnit, "UNIT"));
  verb.add_option("--up", into.up, "Up axis of the file; as --up=-z if it hangs upside down")
      ->check(makeChoiceValidator({"x", "y", "z", "-x", "-y", "-z"}));
  verb.add_option("--offset", into.offset,
                  "Offset (m, Y up) subtracted from the file's coordinates; use one value for all "
                  "versions of a model. Default: 0 near the origin, else the model's position")
      ->delimiter(',')
      ->type_name("X,Y,Z")
      ->expected(3)
      ->check(CLI::Validator(validateAnyNumber, ""));
  verb.add_flag("--no-cache", into.noCache,
                "Import the model again; ignore cached imports and navigation meshes");
  verb.add_option(
          "--ifc-reader", into.ifcReader,
          "IFC reader. auto: web-ifc, else ifcplusplus (also for products that web-ifc omits), "
          "else assimp")
      ->capture_default_str()
      ->check(makeChoiceValidator({"auto", "web-ifc", "ifcplusplus", "assimp"}));
  verb.add_option("--ifc-doors", into.ifcDoors,
                  "IFC doors. move: they are bodies if the file describes their motion; still: "
                  "they and lifts are static; open: static, with open leaves; none: without leaves")
      ->capture_default_str()
      ->check(makeChoiceValidator({"move", "still", "open", "none"}));
  verb.add_flag("--georeference", into.georeference,
                "IFC: apply the file's map conversion, so that coordinates are the map's");
  verb.add_option("--gltf-scene", into.gltfScene,
                  "glTF: scene to read, by name or by number from 0. Default: the file's default")
      ->type_name("NAME|N");
  verb.add_flag("--ignore-appearance", into.ignoreAppearance,
                "glTF: load files that require extensions that change the appearance alone and are "
                "not read");
}

ModelOptions makeModelOptions(const ModelArguments& read) {
  ModelOptions options;
  options.file = read.file;
  options.cache = !read.noCache;
  if (!read.unit.empty()) options.import.metresPerUnit = scene::parseMetresPerUnit(read.unit);
  options.import.up = scene::parseUpAxis(read.up);
  if (!read.offset.empty())
    options.import.offset = {read.offset[0], read.offset[1], read.offset[2]};
  options.import.ifcReader =
      scene::parseIfcReader(read.ifcReader).value_or(scene::IfcReader::automatic);
  options.doors = scene::parseIfcDoors(read.ifcDoors);
  options.import.georeference = read.georeference;
  options.import.gltfScene = read.gltfScene;
  options.import.ignoreAppearance = read.ignoreAppearance;
  return options;
}

}  // namespace enfilade::server
