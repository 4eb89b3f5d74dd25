// The parent's side of an import worker: starts a copy of this executable with hidden arguments,
// receives its messages, and kills it after a timeout.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "scene/import/file/import_options.hpp"
#include "scene/import/worker/ipc_messages.hpp"

namespace enfilade::scene {

/// Task of an import worker.
enum class ImportTask : std::uint8_t {
  model,        ///< the whole import: answers with a model
  assimp,       ///< an IFC file by assimp: answers with a model
  webIfc,       ///< becomes Node.js: answers with meshes of IFC products
  ifcPlusPlus,  ///< answers with meshes of IFC products
  ifcXml,       ///< becomes Node.js: answers with the STEP text of an ifcXML document
};

/// Arguments of an import worker.
struct ImportRequest {
  ImportTask task = ImportTask::model;
  std::string file;
  ImportOptions options;           ///< memoryLimit 0: unlimited
  std::string program, script;     ///< webIfc, ifcXml: the node program and its script
  std::uint32_t firstProduct = 0;  ///< webIfc: index into the requested products
  /// Inherited file descriptors; not owned, -1: unset.
  int ifcFile = -1, ifcProductIds = -1, ifcReady = -1;
};

/// Parses the arguments of a worker; nullopt if they are invalid. `parent`: process id of the
/// parent.
std::optional<ImportRequest> parseImportRequest(int argc, char** argv, int& parent);

/// The end of an import worker.
struct ImportExit {
  enum class Reason : std::uint8_t {
    exited,      ///< closed its pipe and exited; `status` is valid
    timeLimit,   ///< killed after the time limit
    stallLimit,  ///< killed after a time without messages
    malformed    ///< killed after an invalid message
  };
  Reason reason = Reason::exited;
  int status = 0;  ///< as waitpid() returns it; -1: taken by another caller

  /// Returns "crashed (Segmentation fault)", "ended without an answer", ...
  std::string describe() const;
};

/// Handles a message; false: it is invalid. An exception kills the worker and is passed on.
using MessageHandler = std::function<bool(ImportMessage, std::span<const std::byte>)>;

/// Runs a worker until it is gone, in any case. `stallLimit`: maximal seconds without a message,
/// evaluated before each wait; infinity: unlimited. Throws ImportError if the worker cannot be
/// started.
ImportExit runImportProcess(const ImportRequest& request, const MessageHandler& handler,
                            const std::function<double()>& stallLimit);

/// Reads stage and fraction of a progress message; false if it is invalid.
bool readProgress(std::span<const std::byte> body, std::string& stage, double& fraction);

/// Returns the shortest text that parses to the same number.
std::string formatShortest(double value);

}  // namespace enfilade::scene
