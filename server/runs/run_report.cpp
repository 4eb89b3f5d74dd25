#include "server/runs/run_report.hpp"

#include <spdlog/spdlog.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "protocol/recording/recording.hpp"
#include "server/messages/event_names.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {
using Json = nlohmann::ordered_json;

namespace {

constexpr int kSheetColumns = 4;
/// Lists the pictures that walks wrote, one name a line: also those of a walk that was interrupted.
constexpr const char* kWritten = "frames/.written";

Json jsonOf(const v1::Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json jsonOf(const v1::Audit& audit) {
  return {{"ticks", audit.ticks()},
          {"pairs", audit.pairs()},
          {"missed", audit.missed()},
          {"extra", audit.extra()}};
}

const char* outcomeWord(protocol::LineOutcome::Kind kind) {
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

void writeText(const std::filesystem::path& file, const std::string& text) {
  render::writeFileWhole(file, text.data(), text.size());
}

render::Image imageOf(const v1::Frame& description, const std::vector<std::uint8_t>& pixels) {
  for (const v1::Plane& plane : description.planes()) {
    if (plane.channel() != v1::CHANNEL_RGB) continue;
    const auto from = pixels.begin() + static_cast<std::ptrdiff_t>(plane.offset());
    std::vector<std::uint8_t> bytes(from, from + static_cast<std::ptrdiff_t>(plane.length()));
    if (plane.encoding() == v1::ENCODING_PNG) return render::decodePng(bytes);
    return {static_cast<int>(plane.width()), static_cast<int>(plane.height()), std::move(bytes)};
  }
  return {};
}

Json outcomesOf(const protocol::ScriptResult& result) {
  Json outcomes = Json::array();
  for (const protocol::LineOutcome& outcome : result.outcomes) {
    outcomes.push_back({{"kind", outcomeWord(outcome.kind)},
                        {"line", outcome.line},
                        {"tick", outcome.tick},
                        {"avatar", outcome.avatar},
                        {"text", outcome.text}});
  }
  return outcomes;
}

Json walkOf(const v1::Notice& notice) {
  Json walk{{"tick", notice.tick()},
            {"avatar", notice.avatar()},
            {"line", notice.tag()},
            {"outcome", wordOf(notice.kind())},
            {"position", jsonOf(notice.position())}};
  if (!notice.obstacle_name().empty()) walk["obstacle"] = notice.obstacle_name();
  if (!notice.text().empty()) walk["text"] = notice.text();
  return walk;
}

}  // namespace

std::string contactLine(const v1::ContactEvent& event) {
  Json line{{"tick", event.tick()},
            {"time", event.time()},
            {"event", wordOf(event.kind())},
            {"a", event.a_name()},
            {"b", event.b_name()},
            {"verdict", wordOf(event.verdict())},
            {"distance", event.distance()},
            {"point_a", jsonOf(event.point_a())},
            {"point_b", jsonOf(event.point_b())},
            {"normal", jsonOf(event.normal())},
            {"decided_by", event.decided_by() == v1::DECIDED_BY_FILTER ? "filter" : "rational"}};
  if (event.kind() == v1::ContactEvent::KIND_END || event.kind() == v1::ContactEvent::KIND_LEAVE)
    line["reason"] = wordOf(event.reason());
  if (event.kind() == v1::ContactEvent::KIND_NEAR) line["phase"] = wordOf(event.phase());
  if (event.feature_a() != v1::FEATURE_UNSPECIFIED) {
    line["feature_a"] = wordOf(event.feature_a());
    line["feature_b"] = wordOf(event.feature_b());
  }
  // Names come from files: what is not UTF-8 in them is replaced, not thrown at the walker.
  return line.dump(-1, ' ', false, Json::error_handler_t::replace);
}

WalkReport::WalkReport(std::filesystem::path folder) : folder_(std::move(folder)) {
  try {
    std::filesystem::create_directories(folder_ / "frames");
    const std::filesystem::path probe = folder_ / ".writable";
    writeText(probe, "");
    std::filesystem::remove(probe);
  } catch (const std::exception& error) {
    throw ReportError("cannot write into " + folder_.string() + ": " + error.what() +
                      "; give another folder with --out");
  }
}

void WalkReport::removeEarlier() {
  try {
    std::ifstream written(folder_ / kWritten);
    for (std::string name; std::getline(written, name);) {
      if (name.find('/') == std::string::npos) {
        std::filesystem::remove(folder_ / "frames" / (name + ".png"));
      }
    }
    for (const char* file : {"contacts.jsonl", "summary.json", "sheet.png", "map.png", kWritten}) {
      std::filesystem::remove(folder_ / file);
    }
  } catch (const std::exception& error) {
    throw ReportError("cannot remove an earlier walk from " + folder_.string() + ": " +
                      error.what() + "; give another folder with --out");
  }
}

void WalkReport::add(const protocol::StepOutcome& outcome) {
  for (const v1::ContactEvent& event : outcome.contacts) addContact(event);
  for (const v1::Notice& notice : outcome.notices) addNotice(notice);
  for (const v1::AvatarState& avatar : outcome.avatars) {
    const auto [found, isNew] = pathOf_.try_emplace(avatar.name(), trace_.paths.size());
    if (isNew) trace_.paths.push_back({avatar.name(), {}, avatar.id()});
    trace_.paths[found->second].feet.push_back(vectorFrom(avatar.feet()));
  }
  for (const protocol::CapturedFrame& frame : outcome.frames) addFrame(frame, outcome);
}

void WalkReport::addContact(const v1::ContactEvent& event) {
  contactLines_ += contactLine(event) + "\n";
  if (event.kind() != v1::ContactEvent::KIND_BEGIN) return;
  ++begun_;
  trace_.contacts.push_back({vectorFrom(event.point_b()), vectorFrom(event.normal())});
}

void WalkReport::addNotice(const v1::Notice& notice) {
  const bool blocked = notice.kind() == v1::Notice::KIND_BLOCKED;
  if (blocked) trace_.stops.push_back({vectorFrom(notice.position()), Vec3::UnitX()});
  if (notice.kind() == v1::Notice::KIND_SPAWNED) present_.insert(notice.avatar());
  if (notice.kind() == v1::Notice::KIND_LEFT) present_.erase(notice.avatar());
  if (blocked || notice.kind() == v1::Notice::KIND_ARRIVED ||
      notice.kind() == v1::Notice::KIND_REFUSED || notice.kind() == v1::Notice::KIND_LEFT) {
    walks_.push_back(notice);
  }
}

/// A name that is taken a second time gets a number.
std::string WalkReport::freeFrameName(const std::string& wanted) const {
  const auto taken = [this](const std::string& name) {
    return std::any_of(pictures_.begin(), pictures_.end(),
                       [&](const Picture& picture) { return picture.name == name; });
  };
  std::string name = wanted;
  for (int number = 2; taken(name); ++number) name = wanted + "-" + std::to_string(number);
  return name;
}

void WalkReport::addFrame(const protocol::CapturedFrame& frame,
                          const protocol::StepOutcome& outcome) {
  if (!frame.error.empty()) return;  // told by the script's result
  Picture picture;
  picture.name = freeFrameName(frame.name);
  picture.avatar = frame.avatar;
  picture.file = "frames/" + picture.name + ".png";
  picture.tick = outcome.tick;
  picture.image = imageOf(frame.description, frame.pixels);
  for (const v1::AvatarState& avatar : outcome.avatars) {
    if (avatar.name() == frame.avatar) picture.feet = vectorFrom(avatar.feet());
  }
  std::ofstream(folder_ / kWritten, std::ios::app) << picture.name << "\n";
  render::writePng(folder_ / picture.file, picture.image);
  const v1::FreeCamera& camera = frame.description.camera();
  trace_.captures.push_back({picture.name, vectorFrom(camera.eye()), vectorFrom(camera.forward())});
  pictures_.push_back(std::move(picture));
}

void WalkReport::writeContacts(const std::vector<v1::ContactEvent>& ended) {
  for (const v1::ContactEvent& event : ended) addContact(event);
  writeText(folder_ / "contacts.jsonl", contactLines_);
}

void WalkReport::writePictures(const WalkFacts& facts, const MapGround& ground) {
  const std::string title = facts.script + " in " + facts.scene.source();
  if (!pictures_.empty()) {
    std::vector<render::Captioned> captioned;
    for (const Picture& taken : pictures_) {
      char caption[160];
      std::snprintf(caption, sizeof caption, "%s  %s  tick %llu  (%.1f, %.1f, %.1f)",
                    taken.name.c_str(), taken.avatar.c_str(),
                    static_cast<unsigned long long>(taken.tick), taken.feet.x(), taken.feet.y(),
                    taken.feet.z());
      captioned.push_back({taken.image, caption});
    }
    render::writePng(folder_ / "sheet.png", render::contactSheet(captioned, title, kSheetColumns));
  }
  trace_.title = title;
  if (const auto map = drawMap(trace_, ground)) {
    render::writePng(folder_ / "map.png", *map);
  } else {
    spdlog::warn("no map.png: nobody walked, or there is no renderer");
  }
}

std::string WalkReport::writeSummary(const WalkFacts& facts, const protocol::ScriptResult& result) {
  const v1::Metrics& metrics = facts.metrics;
  Json stages = Json::object();
  for (const v1::StageTiming& stage : metrics.stages()) stages[stage.name()] = stage.median_us();
  stages["tick"] = metrics.tick().median_us();
  Json frames = Json::array();
  for (const Picture& picture : pictures_) {
    frames.push_back({{"name", picture.name},
                      {"avatar", picture.avatar},
                      {"tick", picture.tick},
                      {"file", picture.file},
                      {"position", {picture.feet.x(), picture.feet.y(), picture.feet.z()}}});
  }
  Json walks = Json::array();
  for (const v1::Notice& notice : walks_) walks.push_back(walkOf(notice));
  Json summary{{"ticks", result.ticks},
               {"ticks_per_s", metrics.ticks_per_second()},
               {"stages_us", stages},
               {"pairs", facts.mostPairs},
               {"contacts", begun_},
               {"worst_penetration", metrics.worst_penetration()},
               {"squeezed_bodies", metrics.squeezed_bodies()},
               {"state_hash", protocol::hexadecimal(result.stateHash)},
               {"time", result.time},
               {"wall_s", facts.wallSeconds},
               {"scene", facts.scene.source()},
               {"scene_hash", protocol::hexadecimal(facts.scene.hash())},
               {"objects", facts.scene.objects()},
               {"script", facts.script},
               {"renderer", facts.renderer},
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
               {"frames", frames},
               {"walks", walks},
               {"outcomes", outcomesOf(result)}};
  if (metrics.has_audit()) summary["audit"] = jsonOf(metrics.audit());
  const auto replace = Json::error_handler_t::replace;
  writeText(folder_ / "summary.json", summary.dump(2, ' ', false, replace) + "\n");
  return summary.dump(-1, ' ', false, replace);
}

}  // namespace enfilade::server
