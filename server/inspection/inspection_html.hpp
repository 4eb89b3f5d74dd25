// The report of `inspect` on a scene as one HTML page with floor plans.
#pragma once

#include <string>
#include <vector>

#include "render/image/image.hpp"
#include "server/inspection/inspection.hpp"

namespace enfilade::server {

struct StoreyPlan {
  std::string caption;
  render::Image image;
};

/// `accepted`: as for listDiagnostics().
std::string formatInspectionHtml(const Inspection& inspection,
                                 const std::vector<std::string>& accepted,
                                 const std::vector<StoreyPlan>& plans);

}  // namespace enfilade::server
