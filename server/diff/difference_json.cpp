#include "server/diff/difference_json.hpp"

#include <array>
#include <nlohmann/json.hpp>

#include "protocol/recording/recording.hpp"
#include "server/messages/event_names.hpp"

namespace enfilade::server {
namespace {

using Json = nlohmann::ordered_json;

Json toJson(const Vec3& v) {
  return Json::array({v.x(), v.y(), v.z()});
}

Json toJson(const WalkEvent& walkEvent) {
  Json json{{"a", walkEvent.a},
            {"b", walkEvent.b},
            {"tick", walkEvent.tick},
            {"time", walkEvent.time},
            {"point", toJson(walkEvent.point)},
            {"normal", toJson(walkEvent.normal)},
            {"distance", walkEvent.distance}};
  if (!walkEvent.aGlobalId.empty()) json["a_global_id"] = walkEvent.aGlobalId;
  if (!walkEvent.bGlobalId.empty()) json["b_global_id"] = walkEvent.bGlobalId;
  if (walkEvent.ended) json["ended"] = *walkEvent.ended;
  return json;
}

Json toJson(const Nearest& nearest) {
  return {{"distance", nearest.distance},
          {"tick", nearest.tick},
          {"time", nearest.time},
          {"point", toJson(nearest.point)}};
}

Json toJson(const FinishedOrder& end) {
  Json json{{"outcome", toString(end.kind)},
            {"tick", end.tick},
            {"time", end.time},
            {"position", toJson(end.position)}};
  if (!end.obstacle.empty()) json["obstacle"] = end.obstacle;
  if (!end.text.empty()) json["text"] = end.text;
  return json;
}

Json toJson(const AvatarRecord& avatar) {
  return {{"entered", avatar.entered}, {"last", avatar.last}, {"way_length", avatar.pathLength}};
}

template <class Value>
Json toOptionalJson(const std::optional<Value>& value) {
  return value ? toJson(*value) : Json(nullptr);
}

// In the order of the enumerators.
constexpr std::array<const char*, kWalkEventKinds> kKindNames{"blocked", "contact", "fall",
                                                              "enter",   "leave",   "ground"};
constexpr std::array<const char*, 4> kModelNames{"both", "before", "after", "unknown"};

template <class Enum, std::size_t kCount>
const char* toString(Enum value, const std::array<const char*, kCount>& names) {
  return names.at(static_cast<std::size_t>(value));
}

template <class Change>
const char* getChangeName(const Change& change) {
  if (!change.before) return "new";
  return change.after ? "moved" : "gone";
}

template <class Change>
void addCommonFields(Json& json, const Change& change) {
  json["run"] = change.run + 1;
  json["worse"] = change.worse;
  if (!change.picture.empty()) json["picture"] = change.picture;
}

Json toJson(const WalkEventChange& change) {
  Json json{{"kind", toString(change.kind, kKindNames)},
            {"change", getChangeName(change)},
            {"before", toOptionalJson(change.before)},
            {"after", toOptionalJson(change.after)},
            {"b_in_model", toString(change.inModel, kModelNames)}};
  if (change.before && change.after) {
    json["shift"] = change.shift;
    json["delay"] = change.delay;
  }
  if (change.otherDistance) json["otherwise_nearest"] = *change.otherDistance;
  addCommonFields(json, change);
  return json;
}

Json toJson(const OrderChange& change) {
  const FinishedOrder& end = change.after ? *change.after : *change.before;
  Json json{{"avatar", end.avatar},
            {"tag", end.tag},
            {"before", toOptionalJson(change.before)},
            {"after", toOptionalJson(change.after)}};
  addCommonFields(json, change);
  return json;
}

Json toJson(const ClearanceChange& change) {
  Json json{{"a", change.a},
            {"b", change.b},
            {"before", toOptionalJson(change.before)},
            {"after", toOptionalJson(change.after)},
            {"changed_by_at_least", change.minChange},
            {"b_in_model", toString(change.inModel, kModelNames)}};
  addCommonFields(json, change);
  return json;
}

Json toJson(const PathChange& path) {
  return {{"avatar", path.avatar},
          {"before", toOptionalJson(path.before)},
          {"after", toOptionalJson(path.after)},
          {"first_tick", path.firstTick},
          {"farthest", path.maxDistance},
          {"farthest_tick", path.maxDistanceTick},
          {"run", path.run + 1}};
}

Json toJson(const RefusedCommand& refused) {
  return {{"tick", refused.tick}, {"who", refused.name}, {"why", refused.reason}};
}

Json toJson(const RecordedRun& run) {
  return {{"scene", run.start.scene().source()},
          {"scene_hash", protocol::toHex(run.start.scene().hash())},
          {"ticks", run.ticks},
          {"time", run.time},
          {"state_hash", protocol::toHex(run.hash)}};
}

template <class Items>
Json listToJson(const Items& items) {
  Json list = Json::array();
  for (const auto& item : items) list.push_back(toJson(item));
  return list;
}

Json toJson(const RecordedWalk& walk) {
  Json json{{"file", walk.file.string()}, {"closed", walk.closed}, {"runs", listToJson(walk.runs)}};
  if (!walk.closed) json["whole_bytes"] = walk.wholeBytes;
  return json;
}

}  // namespace

std::string formatDifferenceJson(const WalkDifference& difference) {
  const Json json{{"same", difference.isEmpty() && difference.refused.empty()},
                  {"worse", difference.worse},
                  {"tolerance", difference.tolerance},
                  {"before", toJson(difference.before)},
                  {"after", toJson(difference.after)},
                  {"happenings", listToJson(difference.events)},
                  {"orders", listToJson(difference.orders)},
                  {"clearances", listToJson(difference.clearances)},
                  {"ways", listToJson(difference.paths)},
                  {"refused_commands", listToJson(difference.refused)}};
  // Names come from files: bytes that are not UTF-8 are replaced.
  return json.dump(2, ' ', false, Json::error_handler_t::replace);
}

}  // namespace enfilade::server
