// The report of a script run: contacts.jsonl, summary.json, frames/, sheet.png and map.png in one
// folder. It is the same for worlds in this process and behind a socket. Files are written
// atomically.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "protocol/script/script_run.hpp"
#include "server/plans/path_map.hpp"

namespace enfilade::server {

/// Data of a run that its ticks do not contain.
struct RunSummary {
  std::string script;
  v1::Scene scene;
  std::string renderer;  ///< "": none
  v1::Metrics metrics;
  std::uint32_t maxPairs = 0;  ///< maximum number of broad phase pairs
  double wallSeconds = 0;      ///< of the whole run
};

class RunReport {
 public:
  /// Creates the folder and checks that it is writable. Throws std::runtime_error
  /// with its name.
  explicit RunReport(std::filesystem::path folder);

  /// Removes the files of an earlier run, and no others.
  void removePreviousRun();
  /// Adds the data of one tick and writes its pictures.
  void add(const protocol::StepOutcome& outcome);
  /// Writes contacts.jsonl. `ended`: ends of the contacts that were active after the last tick.
  void writeContacts(const std::vector<v1::ContactEvent>& ended);
  /// Names of the run's avatars that are in the world.
  const std::set<std::string>& presentAvatars() const { return presentAvatars_; }

  /// Writes sheet.png and map.png. A failure is logged, and the file is omitted.
  void writePictures(const RunSummary& runSummary, const MapBackground& background);
  /// Writes summary.json and returns it as one line of JSON.
  std::string writeSummary(const RunSummary& runSummary, const protocol::ScriptResult& result);
  const std::filesystem::path& folder() const { return folder_; }
  /// Ends of walks in order: arrived, blocked, refused or left.
  const std::vector<v1::Notice>& walks() const { return walks_; }
  /// The content of the map.
  const WalkTrace& trace() const { return trace_; }

 private:
  struct Picture {
    std::string name, avatar, file;
    std::uint64_t tick = 0;
    Vec3 footPosition = Vec3::Zero();
    render::Image image;
  };
  void addContact(const v1::ContactEvent& event);
  void addNotice(const v1::Notice& notice);
  void addFrame(const protocol::CapturedFrame& frame, const protocol::StepOutcome& outcome);
  std::string makeUniqueFrameName(const std::string& wanted) const;

  std::filesystem::path folder_;
  std::string contactLines_;
  std::set<std::string> presentAvatars_;
  std::uint64_t contactsBegun_ = 0;
  std::map<std::string, std::size_t> pathByAvatar_;  ///< index into trace_.paths by avatar name
  WalkTrace trace_;
  std::vector<Picture> pictures_;
  std::vector<v1::Notice> walks_;  ///< arrived, blocked, refused, left
};

/// Formats one line of contacts.jsonl, without the line end.
std::string formatContactLine(const v1::ContactEvent& event);

}  // namespace enfilade::server
