// The processes that read IFC: starts them, listens to them, starts them again where one product
// brought them down.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "scene/import/ifc/ifc_meshes.hpp"
#include "scene/import/worker/process.hpp"
#include "scene/model/model.hpp"

namespace enfilade::scene {

/// The file and what is wanted of it, in memory that the readers' processes share.
class IfcInput {
 public:
  /// `request`: the import's; its limits hold for each reader.
  IfcInput(const ImportRequest& request, const std::string& text,
           std::vector<std::uint32_t> wanted);
  ~IfcInput();
  IfcInput(const IfcInput&) = delete;
  IfcInput& operator=(const IfcInput&) = delete;

  ImportRequest requestFor(ImportTask task, double timeLimit) const;
  const std::vector<std::uint32_t>& wanted() const { return wanted_; }

 private:
  ImportRequest request_;
  std::vector<std::uint32_t> wanted_;
  int file_ = -1, list_ = -1;
};

struct IfcReading {
  IfcShapes shapes;
  std::string failure;  ///< why it ended before the end; empty: it did not
  bool absent = false;  ///< the reader is not installed; `failure` says how to get it
};

/// Both return what they got, even where they fail. `timeLimit`: seconds for all of it.
IfcReading readByWebIfc(const IfcInput& input, double timeLimit, const ImportProgress& progress);
IfcReading readByIfcPlusPlus(const IfcInput& input, double timeLimit,
                             const ImportProgress& progress);

struct AssimpReading {
  std::optional<Model> model;
  std::string failure;  ///< empty: there is a model
};
AssimpReading readIfcByAssimp(const IfcInput& input, double timeLimit,
                              const ImportProgress& progress);

}  // namespace enfilade::scene
