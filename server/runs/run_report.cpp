#include "server/runs/run_report.hpp"

#include <fmt/core.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "collision/assert.hpp"
#include "protocol/recording/recording.hpp"
#include "render/image/atomic_file.hpp"
#include "render/image/contact_sheet.hpp"
#include "server/base/prepare_folder.hpp"
#include "server/log/log.hpp"
#include "server/messages/event_names.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
using Json = nlohmann::ordered_json;

namespace {

constexpr int kSheetColumns = 4;
/// List of the written pictures, one name per line, also after an interruption.
constexpr const char* kFrameListFile = "frames/.written";

Json toJson(const v1::Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json toJson(const v1::Audit& audit) {
  return {{"ticks", audit.ticks()},
          {"pairs", audit.pairs()},
          {"missed", audit.missed()},
          {"extra", audit.extra()}};
}

const char* getOutcomeName(protocol::LineOutcome::Kind kind) {
  using Kind = protocol::LineOutcome::Kind;
  switch (kind) {
    case Kind::refused:
      return "refused";
    case Kind::blocked:
      return "blocked";
    case Kind::unfinished:
      return "unfinished";
    case Kind::uncaptured:
      return "uncaptured";
    case Kind::dropped:
      return "dropped";
  }
  return "unknown";
}

render::Image toImage(const v1::Frame& description, const std::vector<std::uint8_t>& pixels) {
  for (const v1::Plane& plane : description.planes()) {
    if (plane.channel() != v1::CHANNEL_RGB) continue;
    const auto from = pixels.begin() + static_cast<std::ptrdiff_t>(plane.offset());
    std::vector<std::uint8_t> bytes(from, from + static_cast<std::ptrdiff_t>(plane.length()));
    if (plane.encoding() == v1::ENCODING_PNG) return render::decodePng(bytes);
    return {static_cast<int>(plane.width()), static_cast<int>(plane.height()), std::move(bytes)};
  }
  return {};
}

Json outcomesToJson(const protocol::ScriptResult& result) {
  Json outcomes = Json::array();
  for (const protocol::LineOutcome& outcome : result.outcomes) {
    outcomes.push_back({{"kind", getOutcomeName(outcome.kind)},
                        {"line", outcome.line},
                        {"tick", outcome.tick},
                        {"avatar", outcome.avatar},
                        {"text", outcome.text}});
  }
  return outcomes;
}

Json walkToJson(const v1::Notice& notice) {
  Json walk{{"tick", notice.tick()},
            {"avatar", notice.avatar()},
            {"line", notice.tag()},
            {"outcome", toString(notice.kind())},
            {"position", toJson(notice.position())}};
  if (!notice.obstacle_name().empty()) walk["obstacle"] = notice.obstacle_name();
  if (!notice.obstacle_global_id().empty())
    walk["obstacle_global_id"] = notice.obstacle_global_id();
  if (!notice.text().empty()) walk["text"] = notice.text();
  return walk;
}

}  // namespace

std::string formatContactLine(const v1::ContactEvent& event) {
  Json line{{"tick", event.tick()},
            {"time", event.time()},
            {"event", toString(event.kind())},
            {"a", event.a_name()},
            {"b", event.b_name()},
            {"verdict", toString(event.verdict())},
            {"distance", event.distance()},
            {"point_a", toJson(event.point_a())},
            {"point_b", toJson(event.point_b())},
            {"normal", toJson(event.normal())},
            {"decided_by", event.decided_by() == v1::DECIDED_BY_FILTER ? "filter" : "rational"}};
  if (!event.a_global_id().empty()) line["a_global_id"] = event.a_global_id();
  if (!event.b_global_id().empty()) line["b_global_id"] = event.b_global_id();
  if (!event.storey().empty()) line["storey"] = event.storey();
  if (!event.room().empty()) line["room"] = event.room();
  if (!event.room_name().empty()) line["room_name"] = event.room_name();
  if (event.kind() == v1::ContactEvent::KIND_END || event.kind() == v1::ContactEvent::KIND_LEAVE)
    line["reason"] = toString(event.reason());
  if (event.kind() == v1::ContactEvent::KIND_NEAR) line["phase"] = toString(event.phase());
  if (event.feature_a() != v1::FEATURE_UNSPECIFIED) {
    line["feature_a"] = toString(event.feature_a());
    line["feature_b"] = toString(event.feature_b());
  }
  // Names come from files: bytes that are not UTF-8 are replaced and do not throw.
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

RunReport::RunReport(std::filesystem::path folder) : folder_(std::move(folder)) {
  prepareFolder(folder_);
  prepareFolder(folder_ / "frames");
}

void RunReport::removePreviousRun() {
  try {
    std::ifstream written(folder_ / kFrameListFile);
    for (std::string name; std::getline(written, name);) {
      if (name.find('/') == std::string::npos) {
        std::filesystem::remove(folder_ / "frames" / (name + ".png"));
      }
    }
    for (const char* file :
         {"contacts.jsonl", "summary.json", "sheet.png", "map.png", kFrameListFile}) {
      std::filesystem::remove(folder_ / file);
    }
  } catch (const std::system_error& error) {
    throw std::runtime_error("cannot remove an earlier run from " + folder_.string() + ": " +
                             error.code().message() + "; give another folder with --out");
  }
}

void RunReport::add(const protocol::StepOutcome& outcome) {
  for (const v1::ContactEvent& event : outcome.contacts) addContact(event);
  for (const v1::Notice& notice : outcome.notices) addNotice(notice);
  for (const v1::AvatarState& avatar : outcome.avatars) {
    const auto [found, isNew] = pathByAvatar_.try_emplace(avatar.name(), trace_.paths.size());
    if (isNew) trace_.paths.push_back({avatar.name(), {}, avatar.id()});
    ENFILADE_ASSERT(found->second < trace_.paths.size());
    trace_.paths[found->second].footPositions.push_back(vectorFromProto(avatar.feet()));
  }
  for (const protocol::CapturedFrame& frame : outcome.frames) addFrame(frame, outcome);
}

void RunReport::addContact(const v1::ContactEvent& event) {
  contactLines_ += formatContactLine(event) + "\n";
  if (event.kind() != v1::ContactEvent::KIND_BEGIN) return;
  ++contactsBegun_;
  trace_.contacts.push_back({vectorFromProto(event.point_b()), vectorFromProto(event.normal())});
}

void RunReport::addNotice(const v1::Notice& notice) {
  const bool blocked = notice.kind() == v1::Notice::KIND_BLOCKED;
  const bool refused = notice.kind() == v1::Notice::KIND_REFUSED;
  if ((blocked || refused) && notice.has_position())
    (blocked ? trace_.blockedWalks : trace_.refusedOrders)
        .push_back({vectorFromProto(notice.position()), Vec3::UnitX()});
  if (notice.kind() == v1::Notice::KIND_SPAWNED) presentAvatars_.insert(notice.avatar());
  if (notice.kind() == v1::Notice::KIND_LEFT) presentAvatars_.erase(notice.avatar());
  if (blocked || refused || notice.kind() == v1::Notice::KIND_ARRIVED ||
      notice.kind() == v1::Notice::KIND_LEFT) {
    walks_.push_back(notice);
  }
}

/// Makes a unique name: duplicates get a number.
std::string RunReport::makeUniqueFrameName(const std::string& wanted) const {
  const auto taken = [this](const std::string& name) {
    return std::any_of(pictures_.begin(), pictures_.end(),
                       [&](const Picture& picture) { return picture.name == name; });
  };
  std::string name = wanted;
  for (int number = 2; taken(name); ++number) name = wanted + "-" + std::to_string(number);
  return name;
}

void RunReport::addFrame(const protocol::CapturedFrame& frame,
                         const protocol::StepOutcome& outcome) {
  if (!frame.error.empty()) return;  // reported in the script's result
  Picture picture;
  picture.name = makeUniqueFrameName(frame.name);
  picture.avatar = frame.avatar;
  picture.file = "frames/" + picture.name + ".png";
  picture.tick = outcome.tick;
  picture.image = toImage(frame.description, frame.pixels);
  for (const v1::AvatarState& avatar : outcome.avatars) {
    if (avatar.name() == frame.avatar) picture.footPosition = vectorFromProto(avatar.feet());
  }
  std::ofstream(folder_ / kFrameListFile, std::ios::app) << picture.name << "\n";
  render::writePng(folder_ / picture.file, picture.image);
  const v1::FreeCamera& camera = frame.description.camera();
  trace_.captures.push_back(
      {picture.name, vectorFromProto(camera.eye()), vectorFromProto(camera.forward())});
  pictures_.push_back(std::move(picture));
}

void RunReport::writeContacts(const std::vector<v1::ContactEvent>& ended) {
  for (const v1::ContactEvent& event : ended) addContact(event);
  render::writeFileAtomically(folder_ / "contacts.jsonl", contactLines_);
}

void RunReport::writePictures(const RunSummary& runSummary, const MapBackground& background) {
  const std::string title = runSummary.script + " in " + runSummary.scene.source();
  if (!pictures_.empty()) {
    std::vector<render::CaptionedImage> captioned;
    const auto tenths = [](double metres) { return std::round(10 * metres) / 10 + 0.0; };  // no -0
    for (const Picture& picture : pictures_) {
      captioned.push_back(
          {picture.image,
           fmt::format("{}  {}  tick {}  ({:.1f}, {:.1f}, {:.1f})", picture.name, picture.avatar,
                       picture.tick, tenths(picture.footPosition.x()),
                       tenths(picture.footPosition.y()), tenths(picture.footPosition.z()))});
    }
    render::writePng(folder_ / "sheet.png",
                     render::makeContactSheet(captioned, title, kSheetColumns));
  }
  trace_.title = title;
  if (const auto map = drawMap(trace_, background)) {
    render::writePng(folder_ / "map.png", *map);
  } else {
    logWarning("no map.png: no walks, or no renderer");
  }
}

std::string RunReport::writeSummary(const RunSummary& runSummary,
                                    const protocol::ScriptResult& result) {
  const v1::Metrics& metrics = runSummary.metrics;
  Json stages = Json::object();
  for (const v1::StageTiming& stage : metrics.stages()) stages[stage.name()] = stage.median_us();
  stages["tick"] = metrics.tick().median_us();
  Json frames = Json::array();
  for (const Picture& picture : pictures_) {
    frames.push_back(
        {{"name", picture.name},
         {"avatar", picture.avatar},
         {"tick", picture.tick},
         {"file", picture.file},
         {"position",
          {picture.footPosition.x(), picture.footPosition.y(), picture.footPosition.z()}}});
  }
  Json walks = Json::array();
  for (const v1::Notice& notice : walks_) walks.push_back(walkToJson(notice));
  Json summary{{"ticks", result.ticks},
               {"ticks_per_s", metrics.ticks_per_second()},
               {"stages_us", stages},
               {"pairs", runSummary.maxPairs},
               {"contacts", contactsBegun_},
               {"worst_penetration", metrics.worst_penetration()},
               {"squeezed_bodies", metrics.squeezed_bodies()},
               {"state_hash", protocol::toHex(result.stateHash)},
               {"time", result.time},
               {"wall_s", runSummary.wallSeconds},
               {"scene", runSummary.scene.source()},
               {"scene_hash", protocol::toHex(runSummary.scene.hash())},
               {"objects", runSummary.scene.objects()},
               {"script", runSummary.script},
               {"renderer", runSummary.renderer},
               {"spawned", result.spawned},
               {"arrived", result.arrived},
               {"blocked", result.blocked},
               {"refused", result.refused},
               {"dropped", result.dropped},
               {"unfinished", result.unfinished},
               {"captured", result.captured},
               {"uncaptured", result.uncaptured},
               {"narrow_queries", metrics.narrow_queries()},
               {"rational_queries", metrics.rational_queries()},
               {"vertices_looked_at", metrics.vertices_looked_at()},
               {"part_boxes_made", metrics.part_boxes_made()},
               {"parts_looked_at", metrics.parts_looked_at()},
               {"frames", frames},
               {"walks", walks},
               {"outcomes", outcomesToJson(result)}};
  if (metrics.has_costliest_avatar()) {
    const v1::AvatarWork& work = metrics.costliest_avatar();
    summary["costliest_avatar"] = {{"id", work.id()},
                                   {"tick", work.tick()},
                                   {"narrow_queries", work.narrow_queries()},
                                   {"parts_looked_at", work.parts_looked_at()},
                                   {"position", toJson(work.position())}};
  }
  if (metrics.has_audit()) summary["audit"] = toJson(metrics.audit());
  const auto replace = Json::error_handler_t::replace;
  render::writeFileAtomically(folder_ / "summary.json",
                              summary.dump(2, ' ', false, replace) + "\n");
  return summary.dump(-1, ' ', false, replace);
}

}  // namespace enfilade::server
