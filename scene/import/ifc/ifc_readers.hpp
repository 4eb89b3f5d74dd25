// Runs the IFC reader processes: starts them, receives their messages, and restarts web-ifc after a
// product that crashed it. Two processes of web-ifc read a large file at the same time.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "scene/import/file/ifc_parts.hpp"
#include "scene/import/ifc/ifc_meshes.hpp"
#include "scene/import/worker/process.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The file and the requested products, in memory shared with the reader processes.
class IfcInput {
 public:
  /// The products that one process of web-ifc reads.
  struct Part {
    std::vector<std::uint32_t> products;
    int listDescriptor = -1;
  };

  /// `request`: the import request; its limits apply to each reader process. `parts`: of the file,
  /// for as many processes of web-ifc; empty: one reads the whole file.
  IfcInput(const ImportRequest& request, const std::string& text, std::vector<std::uint32_t> wanted,
           const std::vector<IfcPart>& parts);
  ~IfcInput();
  IfcInput(const IfcInput&) = delete;
  IfcInput& operator=(const IfcInput&) = delete;

  ImportRequest makeRequest(ImportTask task, double timeLimit) const;
  const std::vector<Part>& parts() const { return parts_; }

 private:
  explicit IfcInput(const ImportRequest& request) : request_(request) {}
  void addPart(const IfcPart& part);

  ImportRequest request_;
  std::vector<Part> parts_;  ///< at least one
  int fileDescriptor_ = -1, listDescriptor_ = -1;
};

/// The result of a reader that delivers meshes.
struct IfcReadResult {
  IfcMeshes meshes;
  std::string failure;        ///< reason for an early end; empty: complete
  bool notInstalled = false;  ///< the reader is not installed; `failure` states how to install it
};

/// Both return the meshes received so far, even on failure. `timeLimit`: total seconds.
IfcReadResult readWithWebIfc(const IfcInput& input, double timeLimit,
                             const ImportProgress& progress);
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
