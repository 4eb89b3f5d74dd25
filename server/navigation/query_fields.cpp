#include "server/navigation/query_fields.hpp"

#include <cstdio>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

constexpr double kNextToObject = 1;     // metres
constexpr double kMaxCoordinate = 1e7;  // metres
constexpr double kMaxDrop = 10;         // metres

std::variant<QueryPlace, v1::Error> findQueryPlace(const v1::NavigationPlace& place,
                                                   const std::string& field,
                                                   const scene::Scene& scene,
                                                   const scene::Snapshot& snapshot, double radius) {
  if (place.has_point()) {
    if (auto error = validatePoint(field + ".point", place.point())) return std::move(*error);
    return vectorFromProto(place.point());
  }
  if (place.has_avatar()) {
    const scene::AvatarSnapshot* avatar = findAvatar(snapshot, place.avatar());
    if (!avatar) return makeUnknownAvatarError(place.avatar(), "navigation." + field + ".avatar");
    return avatar->footPosition;
  }
  if (place.name().empty()) return makeNavigationError(field, "give a point, a name or an avatar");
  if (auto named = scene::findNamedPlaces(scene, place.name(), radius + kNextToObject);
      !named.empty())
    return named;
  return makeNavigationError(
      field + ".name",
      "no room, storey, object or body is named '" + place.name() + "', or its extent is not known",
      v1::ERROR_UNKNOWN_ENTITY);
}

}  // namespace

v1::Error makeNavigationError(const std::string& field, const std::string& remedy,
                              v1::ErrorCode code) {
  return makeError(code, "navigation." + field + ": " + remedy, "navigation." + field);
}

std::optional<v1::Error> validateNumber(const std::string& field, double value, double low,
                                        double high) {
  if (value >= low && value <= high) return std::nullopt;
  char text[96];
  std::snprintf(text, sizeof text, "give %g to %g, not %g", low, high, value);
  return makeNavigationError(field, text);
}

std::optional<v1::Error> validateCount(const std::string& field, std::int64_t count,
                                       std::int64_t limit) {
  if (count >= 1 && count <= limit) return std::nullopt;
  return makeNavigationError(field, "give 1 to " + std::to_string(limit),
                             count < 1 ? v1::ERROR_BAD_MESSAGE : v1::ERROR_TOO_LARGE);
}

std::optional<v1::Error> validatePoint(const std::string& field, const v1::Vec3& point) {
  const scene::Vec3 place = vectorFromProto(point);
  if (place.allFinite() && place.cwiseAbs().maxCoeff() <= kMaxCoordinate) return std::nullopt;
  return makeNavigationError(field, "give finite coordinates of at most 1e7 m");
}

std::variant<PathPlaces, v1::Error> findPathPlaces(const v1::NavigationQuery::Path& query,
                                                   const scene::Scene& scene,
                                                   const scene::Snapshot& snapshot, double radius) {
  if (auto error = validateCount("path.to", query.to_size(), 100)) return std::move(*error);
  if (auto error = validateNumber("path.max_drop", query.max_drop(), 0, kMaxDrop))
    return std::move(*error);
  if (query.keep() && (!query.from().has_avatar() || query.to_size() != 1 ||
                       query.max_drop() != 0 || query.lifts()))
    return makeNavigationError("path.keep",
                               "give an avatar as 'from' and one goal, without max_drop and lifts");
  PathPlaces places;
  auto from = findQueryPlace(query.from(), "path.from", scene, snapshot, radius);
  if (auto* error = std::get_if<v1::Error>(&from)) return std::move(*error);
  places.from = std::get<QueryPlace>(from);
  for (int i = 0; i < query.to_size(); ++i) {
    const std::string field = "path.to[" + std::to_string(i) + "]";
    auto to = findQueryPlace(query.to(i), field, scene, snapshot, radius);
    if (auto* error = std::get_if<v1::Error>(&to)) return std::move(*error);
    places.to.push_back(std::get<QueryPlace>(to));
  }
  return places;
}

}  // namespace enfilade::server
