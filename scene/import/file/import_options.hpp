// Options, progress and errors of an import.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>

#include "collision/types.hpp"
#include "scene/model/up_axis.hpp"

namespace enfilade::scene {

using collision::Vec3;

/// Reader of IFC files. `automatic`: web-ifc in Node.js, ifcplusplus if web-ifc is missing or fails
/// and for products that it omits, assimp last. The others: only that one.
enum class IfcReader : std::uint8_t { automatic, webIfc, ifcPlusPlus, assimp };

/// Options of importModel().
struct ImportOptions {
  /// Overrides the file's unit (nullopt: that of the file, or one metre per unit).
  std::optional<double> metresPerUnit;
  std::optional<UpAxis> up;
  /// Metres, Y up: subtracted from the file's coordinates (nullopt: chosen so that the scene lies
  /// near its origin).
  std::optional<Vec3> offset;
  IfcReader ifcReader = IfcReader::automatic;
  /// IFC: applies the file's map conversion. The file's coordinates are then those of the map: x
  /// east, y up, -z north.
  bool georeference = false;
  /// glTF: the scene to read, by its name or its number from 0; empty: the file's default.
  std::string gltfScene;
  /// glTF: reads files that require extensions that change the appearance alone and are not read.
  bool ignoreAppearance = false;
  double timeLimit = 120;                          ///< seconds of wall-clock time
  std::size_t memoryLimit = std::size_t{8} << 30;  ///< bytes, of each reading process
};

/// Bytes of text that an import takes from a file or an archive: a part of its memory limit.
std::size_t computeMaxTextBytes(const ImportOptions& options);

/// An import failed. The text names the file, the stage ("open", "parse", "convert", ...) and a
/// remedy.
struct ImportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Called now and then with a stage and a fraction 0..1; may be empty.
using ImportProgress = std::function<void(const std::string& stage, double fraction)>;

/// Parses `--ifc-reader`: auto, web-ifc, ifcplusplus or assimp.
std::optional<IfcReader> parseIfcReader(const std::string& text);

/// Parses `--unit`: m, mm, cm, ft, in or a positive number of metres. nullopt: neither.
std::optional<double> parseMetresPerUnit(const std::string& text);

}  // namespace enfilade::scene
