// What a walk leaves behind: contacts.jsonl, summary.json, frames/, sheet.png and map.png in one
// folder, the same whether the world was in this process or behind a socket. Files appear whole.
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "protocol/script/script.hpp"
#include "server/plans/path_map.hpp"

namespace enfilade::server {

/// Names the folder or file that cannot be written.
struct ReportError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// What the walk does not know itself.
struct WalkFacts {
  std::string script;
  v1::Scene scene;
  std::string renderer;  ///< "" when there is none
  v1::Metrics metrics;
  std::uint32_t mostPairs = 0;  ///< that the broad phase held
  double wallSeconds = 0;       ///< of the whole walk
};

class WalkReport {
 public:
  /// Makes the folder and proves that it can be written. Throws ReportError.
  explicit WalkReport(std::filesystem::path folder);

  /// Removes what an earlier walk left in the folder, and nothing else.
  void removeEarlier();
  /// Takes note of one tick and writes its pictures.
  void add(const protocol::StepOutcome& outcome);
  /// Writes contacts.jsonl, with how the contacts ended that the walk left.
  void writeContacts(const std::vector<v1::ContactEvent>& ended);
  /// Who is in the world, of those that the walk moved.
  const std::set<std::string>& present() const { return present_; }

  /// Draws sheet.png and map.png; what cannot be had is told and left out.
  void writePictures(const WalkFacts& facts, const MapGround& ground);
  /// Writes summary.json and returns it as one line of JSON.
  std::string writeSummary(const WalkFacts& facts, const protocol::ScriptResult& result);
  const std::filesystem::path& folder() const { return folder_; }
  /// How walks ended, in order: arrived, blocked, refused or left.
  const std::vector<v1::Notice>& walks() const { return walks_; }

 private:
  struct Picture {
    std::string name, avatar, file;
    std::uint64_t tick = 0;
    Vec3 feet = Vec3::Zero();
    render::Image image;
  };
  void addContact(const v1::ContactEvent& event);
  void addNotice(const v1::Notice& notice);
  void addFrame(const protocol::CapturedFrame& frame, const protocol::StepOutcome& outcome);
  std::string freeFrameName(const std::string& wanted) const;

  std::filesystem::path folder_;
  std::string contactLines_;
  std::set<std::string> present_;
  std::uint64_t begun_ = 0;
  std::map<std::string, std::size_t> pathOf_;  ///< index into trace_.paths by the avatar's name
  WalkTrace trace_;
  std::vector<Picture> pictures_;
  std::vector<v1::Notice> walks_;  ///< arrived, blocked, refused, left
};

/// One line of contacts.jsonl, without its end.
std::string contactLine(const v1::ContactEvent& event);

}  // namespace enfilade::server
