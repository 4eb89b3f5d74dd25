#include <nlohmann/json.hpp>

#include "protocol/recording/recording.hpp"
#include "server/diff/difference_report.hpp"
#include "server/messages/event_names.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;

Json jsonOf(const Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json jsonOf(const Happening& happening) {
  Json json{{"a", happening.a},
            {"b", happening.b},
            {"tick", happening.tick},
            {"time", happening.time},
            {"point", jsonOf(happening.point)},
            {"normal", jsonOf(happening.normal)},
            {"distance", happening.distance}};
  if (happening.ended) json["ended"] = *happening.ended;
  return json;
}

Json jsonOf(const Nearest& nearest) {
  return {{"distance", nearest.distance},
          {"tick", nearest.tick},
          {"time", nearest.time},
          {"point", jsonOf(nearest.point)}};
}

Json jsonOf(const OrderEnd& end) {
  Json json{{"outcome", wordOf(end.kind)},
            {"tick", end.tick},
            {"time", end.time},
            {"position", jsonOf(end.position)}};
  if (!end.obstacle.empty()) json["obstacle"] = end.obstacle;
  if (!end.text.empty()) json["text"] = end.text;
  return json;
}

Json jsonOf(const AvatarRecord& avatar) {
  return {{"entered", avatar.entered}, {"last", avatar.last}, {"way_length", avatar.wayLength}};
}

template <class Value>
Json optionalJson(const std::optional<Value>& value) {
  return value ? jsonOf(*value) : Json(nullptr);
}

const char* wordOf(HappeningKind kind) {
  switch (kind) {
    case HappeningKind::blocked:
      return "blocked";
    case HappeningKind::contact:
      return "contact";
    case HappeningKind::fall:
      return "fall";
    case HappeningKind::enter:
      return "enter";
    case HappeningKind::leave:
      return "leave";
    case HappeningKind::ground:
      return "ground";
  }
  return "unknown";
}

const char* wordOf(Model model) {
  switch (model) {
    case Model::both:
      return "both";
    case Model::before:
      return "before";
    case Model::after:
      return "after";
    default:
      return "unknown";
  }
}

template <class Change>
const char* changeWord(const Change& change) {
  if (!change.before) return "new";
  return change.after ? "moved" : "gone";
}

template <class Change>
void addEnd(Json& json, const Change& change) {
  json["run"] = change.run + 1;
  json["worse"] = change.worse;
  if (!change.picture.empty()) json["picture"] = change.picture;
}

Json jsonOf(const HappeningChange& change) {
  Json json{{"kind", wordOf(change.kind)},
            {"change", changeWord(change)},
            {"before", optionalJson(change.before)},
            {"after", optionalJson(change.after)},
            {"b_in_model", wordOf(change.inModel)}};
  if (change.before && change.after) {
    json["shift"] = change.shift;
    json["delay"] = change.delay;
  }
  if (change.otherwise) json["otherwise_nearest"] = *change.otherwise;
  addEnd(json, change);
  return json;
}

Json jsonOf(const OrderChange& change) {
  const OrderEnd& told = change.after ? *change.after : *change.before;
  Json json{{"avatar", told.avatar},
            {"tag", told.tag},
            {"before", optionalJson(change.before)},
            {"after", optionalJson(change.after)}};
  addEnd(json, change);
  return json;
}

Json jsonOf(const ClearanceChange& change) {
  Json json{{"a", change.a},
            {"b", change.b},
            {"before", optionalJson(change.before)},
            {"after", optionalJson(change.after)},
            {"changed_by_at_least", change.least},
            {"b_in_model", wordOf(change.inModel)}};
  addEnd(json, change);
  return json;
}

Json jsonOf(const WayChange& way) {
  return {{"avatar", way.avatar},
          {"before", optionalJson(way.before)},
          {"after", optionalJson(way.after)},
          {"first_tick", way.firstTick},
          {"farthest", way.farthest},
          {"farthest_tick", way.farthestTick},
          {"run", way.run + 1}};
}

Json jsonOf(const RefusedCommand& refused) {
  return {{"tick", refused.tick}, {"who", refused.who}, {"why", refused.why}};
}

Json jsonOf(const RecordedRun& run) {
  return {{"scene", run.start.scene().source()},
          {"scene_hash", protocol::hexadecimal(run.start.scene().hash())},
          {"ticks", run.ticks},
          {"time", run.time},
          {"state_hash", protocol::hexadecimal(run.hash)}};
}

template <class Items>
Json listOf(const Items& items) {
  Json list = Json::array();
  for (const auto& item : items) list.push_back(jsonOf(item));
  return list;
}

Json jsonOf(const RecordedWalk& walk) {
  Json json{{"file", walk.file.string()}, {"closed", walk.closed}, {"runs", listOf(walk.runs)}};
  if (!walk.closed) json["whole_bytes"] = walk.wholeBytes;
  return json;
}

}  // namespace

std::string differenceJson(const WalkDifference& difference) {
  const Json json{{"same", difference.none() && difference.refused.empty()},
                  {"worse", difference.worse},
                  {"tolerance", difference.tolerance},
                  {"before", jsonOf(difference.before)},
                  {"after", jsonOf(difference.after)},
                  {"happenings", listOf(difference.happenings)},
                  {"orders", listOf(difference.orders)},
                  {"clearances", listOf(difference.clearances)},
                  {"ways", listOf(difference.ways)},
                  {"refused_commands", listOf(difference.refused)}};
  // Names come from files: what is not UTF-8 in them is replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace enfilade::server
