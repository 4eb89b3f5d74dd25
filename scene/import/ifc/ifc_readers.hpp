// Runs the IFC reader processes: starts them, receives their messages, and restarts web-ifc after a
// product that crashed it. Two processes of web-ifc read a large file at the same time.
#pragma once

#include <cstdint>
#include <future>
#include <latch>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/ifc_parts.hpp"
#include "scene/import/ifc/ifc_meshes.hpp"
#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/worker/process.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The file and the requested products, in memory shared with the reader processes. web-ifc may
/// start before they are there.
class IfcInput {
 public:
  /// `request`: the import request; its limits apply to each reader process. `parts`: the number of
  /// processes of web-ifc.
  IfcInput(const ImportRequest& request, std::size_t parts);
  ~IfcInput();
  IfcInput(const IfcInput&) = delete;
  IfcInput& operator=(const IfcInput&) = delete;

  /// To be called once. `parts`: of the file, as many as processes; empty: the first process reads
  /// the whole file.
  void fill(const std::string& text, std::vector<std::uint32_t> wanted,
            std::vector<IfcFilePart> parts);
  /// Lets web-ifc end without products, unless the input is filled.
  void abandon();
  /// Waits for fill() or abandon().
  void waitUntilFilled() const { filled_.wait(); }

  ImportRequest makeRequest(ImportTask task, double timeLimit) const;
  ImportRequest makePartRequest(std::size_t part, double timeLimit) const;
  std::size_t partCount() const { return parts_.size(); }
  /// Only when the input is filled.
  const std::vector<std::uint32_t>& products(std::size_t part) const {
    return parts_[part].products;
  }

 private:
  /// The products that one process of web-ifc reads.
  struct Part {
    std::vector<std::uint32_t> products;
    int listDescriptor = -1;
  };

  explicit IfcInput(const ImportRequest& request) : request_(request) {}

  ImportRequest request_;
  std::vector<Part> parts_;  ///< at least one
  int fileDescriptor_ = -1, listDescriptor_ = -1;
  int readyDescriptor_ = -1;    ///< a pipe, at its end when the input is filled
  int unreadyDescriptor_ = -1;  ///< the other end; open until then
  std::latch filled_{1};
};

/// The result of a reader that delivers meshes.
struct IfcReadResult {
  IfcMeshes meshes;
  std::string failure;        ///< reason for an early end; empty: complete
  bool notInstalled = false;  ///< the reader is not installed; `failure` states how to install it
};

/// The processes of web-ifc. They start at once, so that Node.js starts while the file is indexed.
class WebIfcReading {
 public:
  /// `timeLimit`: total seconds. `progress` is called by other threads until finish() returns. The
  /// arguments outlive this object.
  WebIfcReading(IfcInput& input, double timeLimit, const ImportProgress& progress);
  ~WebIfcReading();  ///< abandons the input and waits
  WebIfcReading(const WebIfcReading&) = delete;
  WebIfcReading& operator=(const WebIfcReading&) = delete;

  /// Waits for the meshes, once; the input must be filled. Returns those received so far, even on
  /// failure.
  IfcReadResult finish();

 private:
  IfcReadResult readPart(std::size_t part, double timeLimit);
  void reportProgress(std::size_t part, const std::string& stage, double fraction);

  IfcInput& input_;
  const WebIfcLocation location_;
  const ImportProgress& progress_;
  std::mutex mutex_;  // of the progress
  std::vector<double> fractions_;
  std::vector<std::future<IfcReadResult>> readings_;
};

/// Returns the meshes received so far, even on failure. `timeLimit`: total seconds.
IfcReadResult readWithIfcPlusPlus(const IfcInput& input, double timeLimit,
                                  const ImportProgress& progress);

/// The result of reading IFC with assimp.
struct AssimpReadResult {
  std::optional<Model> model;
  std::string failure;  ///< empty: `model` is set
};
AssimpReadResult readIfcWithAssimp(const IfcInput& input, double timeLimit,
                                   const ImportProgress& progress);

}  // namespace enfilade::scene
