// `enfilade inspect`: reports contents and problems of a scene, and draws plans of its storeys.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/base/exit_code.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

struct InspectCommand {
  ModelOptions model;
  bool json = false;
  bool objects = false;               ///< list all objects
  bool strict = false;                ///< warnings and errors cause the exit code `violations`
  std::vector<std::string> accepted;  ///< kinds of problems that do not; or kAllWarnings
  std::filesystem::path html;         ///< file for the report as a page; empty: none
  std::filesystem::path plan;         ///< folder for one plan per storey; empty: no plans
  std::string planFormat = "png";     ///< or svg, pdf
  double planScale = 100;             ///< of svg and pdf: 1:planScale
};

/// Throws scene::ImportError, and render::RenderError if plans cannot be drawn.
ExitCode inspect(const InspectCommand& command);

}  // namespace enfilade::server
