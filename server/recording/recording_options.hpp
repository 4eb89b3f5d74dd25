// What is written down of a world, and where.
#pragma once

#include "server/app/command_line.hpp"

namespace enfilade::server {

struct RecordingOptions {
  RecordingChoice choice;
  ModelOptions model;   ///< how the scene was imported
  bool replace = true;  ///< begins a file anew that is there; else that is refused
};

}  // namespace enfilade::server
