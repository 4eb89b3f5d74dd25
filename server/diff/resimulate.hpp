// Re-simulation: runs the recorded commands in another model, and compares both walks.
#pragma once

#include <cstdint>
#include <filesystem>

#include "server/base/drawing_options.hpp"
#include "server/base/exit_code.hpp"
#include "server/base/load_scene.hpp"

namespace enfilade::server {

struct ResimulateCommand {
  ModelOptions model;
  std::filesystem::path recording, out;
  std::filesystem::path record;  ///< recording of the new walk; empty: new.mcap in `out`
  double tolerance = 0.001;      ///< as DiffCommand::tolerance
  bool json = false;
  std::uint32_t pictures = 12;  ///< maximum number of change pictures
  DrawingOptions drawing;
  std::uint32_t run = 1;  ///< number of the run in the recording
};

/// Writes contacts.jsonl, summary.json, pictures and a recording, as replay() does, and diff.json,
/// diff.txt and changes/. Returns `violations` if something got worse. Throws the exceptions of
/// replay() and protocol::mcap::RecordingError.
ExitCode resimulate(const ResimulateCommand& command);

}  // namespace enfilade::server
