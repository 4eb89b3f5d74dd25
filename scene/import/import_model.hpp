// Reads a model file. assimp does the parsing, in a child process of our own executable, because it
// can crash, hang or eat the memory on a bad file; what comes back is one compact Model.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include "scene/model/model.hpp"

namespace enfilade::scene {

/// Who reads IFC. `automatic`: web-ifc in Node.js; where that is missing or fails, and for products
/// that it leaves out, ifcplusplus; assimp last. The others: that one alone.
enum class IfcReader : std::uint8_t { automatic, webIfc, ifcPlusPlus, assimp };

struct ImportOptions {
  /// Overrides what the file says (nullopt: as the file says, else one unit is one metre).
  std::optional<double> metresPerUnit;
  std::optional<char> up;  ///< 'x', 'y' or 'z'
  /// Metres, Y up: taken off the file's coordinates (nullopt: what brings the scene near its
  /// origin).
  std::optional<Vec3> offset;
  IfcReader ifcReader = IfcReader::automatic;
  double timeLimit = 120;                          ///< seconds of wall-clock time
  std::size_t memoryLimit = std::size_t{8} << 30;  ///< bytes, of each process that reads
};

/// Names the file, the stage ("open", "parse", "convert", ...) and what to try.
struct ImportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// `progress` is called now and then with a stage and a fraction 0..1 (may be empty).
using ImportProgress = std::function<void(const std::string& stage, double fraction)>;

/// The model in metres, Y up, near its origin. Throws ImportError.
Model importModel(const std::filesystem::path& file, const ImportOptions& options = {},
                  const ImportProgress& progress = {});

/// Every program that imports calls this first in main(): importModel() starts the program again
/// with hidden arguments, and that copy does the reading. Returns the copy's exit code, or nullopt
/// when the arguments are not the hidden ones and the program goes on as usual.
///
/// For tests, the environment variable ENFILADE_IMPORT_FAULT makes the copy misbehave once it runs:
/// `hang`, `crash`, `exit` (without an answer), `memory` (asks for more than it may) or `garbage`
/// (answers with noise). `web-ifc:hang` and the like make only the copy that is to become that
/// reader of IFC misbehave: web-ifc, ifcplusplus or assimp.
std::optional<int> runImportChild(int argc, char** argv);

/// Extensions that importModel() knows, lower case, with the dot.
std::span<const std::string_view> importableExtensions();

/// Parses `--ifc-reader`: auto, web-ifc, ifcplusplus or assimp.
std::optional<IfcReader> ifcReaderFrom(const std::string& text);

/// Parses `--unit`: m, mm, cm, ft, in or a positive number of metres. nullopt when it is neither.
std::optional<double> metresPerUnitFrom(const std::string& text);

}  // namespace enfilade::scene
