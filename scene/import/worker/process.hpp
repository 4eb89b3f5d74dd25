// The asking side of an importing process: starts a copy of our own executable with hidden
// arguments, listens to its frames, and ends it when it takes too long.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scene/import/import_model.hpp"
#include "scene/import/worker/ipc_messages.hpp"

namespace enfilade::scene {

/// What the copy shall do.
enum class ImportTask : std::uint8_t {
  model,        ///< the whole import: answers with a model
  assimp,       ///< an IFC file by assimp: answers with a model
  webIfc,       ///< becomes Node.js: answers with shapes of IFC products
  ifcPlusPlus,  ///< answers with shapes of IFC products
};

struct ImportRequest {
  ImportTask task = ImportTask::model;
  std::string file;
  std::optional<double> metresPerUnit;
  std::optional<char> up;
  std::optional<Vec3> offset;
  IfcReader ifcReader = IfcReader::automatic;
  std::size_t memoryLimit = 0;       ///< bytes; 0: none
  double timeLimit = 0;              ///< seconds
  std::string program, script;       ///< webIfc: node, and what it runs
  std::uint32_t firstProduct = 0;    ///< webIfc: index into the wanted ones
  int ifcFile = -1, ifcWanted = -1;  ///< file descriptors handed on; not owned, -1: none
};

/// The request as the copy finds it in its arguments; nullopt when it makes no sense.
/// `parent`: the process that asked.
std::optional<ImportRequest> importRequestFrom(int argc, char** argv, int& parent);

struct ImportEnd {
  enum class How : std::uint8_t {
    exited,      ///< closed its pipe and ended; `status` holds
    timeLimit,   ///< killed, its time was over
    stallLimit,  ///< killed, it was silent for too long
    garbled      ///< killed, it wrote what is no frame
  };
  How how = How::exited;
  int status = 0;  ///< as waitpid() gives it; -1: somebody else has taken it

  /// "crashed (Segmentation fault)", "ended without an answer", ...
  std::string words() const;
};

/// Takes a frame; false: it makes no sense. What it throws ends the process and is passed on.
using TakeFrame = std::function<bool(ImportFrame, std::span<const std::byte>)>;

/// Returns when the process is gone, in any case. `stallLimit`: seconds without a frame, asked
/// before each wait; infinity: none. Throws ImportError when no process can be started.
ImportEnd runImportProcess(const ImportRequest& request, const TakeFrame& take,
                           const std::function<double()>& stallLimit);

/// A progress frame's stage and fraction; false when it is none.
bool readProgress(std::span<const std::byte> body, std::string& stage, double& fraction);

/// The shortest text that reads back as the same number.
std::string shortest(double value);

}  // namespace enfilade::scene
