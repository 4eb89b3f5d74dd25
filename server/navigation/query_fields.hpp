// Validates the fields of navigation queries, and looks up the places of a path query.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/enfilade.pb.h"
#include "scene/navigation/place_names.hpp"
#include "scene/world/data/snapshot.hpp"

namespace enfilade::server {

/// `field` is a path below `navigation.`.
v1::Error makeNavigationError(const std::string& field, const std::string& remedy,
                              v1::ErrorCode code = v1::ERROR_BAD_MESSAGE);

// Each returns nullopt if the value is valid.
std::optional<v1::Error> validateNumber(const std::string& field, double value, double low,
                                        double high);
std::optional<v1::Error> validateCount(const std::string& field, std::int64_t count,
                                       std::int64_t limit);
std::optional<v1::Error> validatePoint(const std::string& field, const v1::Vec3& point);

/// A point, or where to look for one.
using QueryPlace = std::variant<scene::Vec3, std::vector<scene::NamedPlace>>;

struct PathPlaces {
  QueryPlace from;
  std::vector<QueryPlace> to;
};

/// Checks a path query and looks its places up. Needs no navigation mesh. `radius`: of the walker,
/// metres.
std::variant<PathPlaces, v1::Error> findPathPlaces(const v1::NavigationQuery::Path& query,
                                                   const scene::Scene& scene,
                                                   const scene::Snapshot& snapshot, double radius);

}  // namespace enfilade::server
