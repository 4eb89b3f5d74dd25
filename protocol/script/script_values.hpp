// Reads numbers, points and names from the JSON of a script line; private to protocol/script/. Each
// function throws LineError, which names the field and what is expected.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "protocol/enfilade.pb.h"

namespace enfilade::protocol {

/// Formats a JSON value for a message, shortened.
std::string makeExcerpt(const nlohmann::json& value);

double parseNumber(const nlohmann::json& value, std::string_view field, const char* what);
/// Parses a number from `low` to `high`; with `above`, `low` itself is refused.
double parseNumberInRange(const nlohmann::json& value, std::string_view field, const char* what,
                          double low, double high, bool above = false);
bool parseFlag(const nlohmann::json& value, std::string_view field);
/// [x, y, z] in metres.
void readPoint(const nlohmann::json& value, const std::string& field, v1::Vec3* point);
/// 1..64 letters, digits, '.', '_' and '-'.
std::string parseName(const nlohmann::json& value, std::string_view field, const char* what);
const nlohmann::json& requireKey(const nlohmann::json& line, const char* key, const char* example);

}  // namespace enfilade::protocol
