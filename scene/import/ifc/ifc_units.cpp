// The length unit of an IFC file, and where it lies on a map.
#include <algorithm>
#include <cmath>
#include <map>

#include "scene/import/ifc/ifc_metadata.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMostSteps = 4;  // from a unit to the SI unit that it is made of

std::optional<double> siPrefix(std::string_view argument) {
  static const std::map<std::string_view, double> kPrefixes{
      {"EXA", 1e18},  {"PETA", 1e15},  {"TERA", 1e12},   {"GIGA", 1e9},
      {"MEGA", 1e6},  {"KILO", 1e3},   {"HECTO", 1e2},   {"DECA", 1e1},
      {"DECI", 1e-1}, {"CENTI", 1e-2}, {"MILLI", 1e-3},  {"MICRO", 1e-6},
      {"NANO", 1e-9}, {"PICO", 1e-12}, {"FEMTO", 1e-15}, {"ATTO", 1e-18}};
  if (argument == "$") return 1;
  const auto prefix = kPrefixes.find(stepSymbol(argument));
  return prefix == kPrefixes.end() ? std::nullopt : std::optional(prefix->second);
}

/// Metres in a unit; a conversion-based one is a number of another. The steps are bounded, since a
/// broken file may refer in a circle.
std::optional<double> metresIn(const StepFile& file, std::uint32_t id, int steps = kMostSteps) {
  const StepStatement* unit = file.find(id);
  if (unit == nullptr || steps == 0) return std::nullopt;
  const std::vector<std::string_view> arguments = stepArguments(unit->arguments);
  if (unit->type == "IFCSIUNIT" && arguments.size() == 4) return siPrefix(arguments[2]);
  const auto next = [&](std::size_t index) -> std::optional<double> {
    const auto reference =
        index < arguments.size() ? stepReference(arguments[index]) : std::nullopt;
    return reference ? metresIn(file, *reference, steps - 1) : std::nullopt;
  };
  // (dimensions, type, name, factor) and (number, unit)
  if (unit->type.starts_with("IFCCONVERSIONBASEDUNIT")) return next(3);
  if (unit->type != "IFCMEASUREWITHUNIT" || arguments.size() != 2) return std::nullopt;
  const auto number = stepNumber(arguments[0]);
  const auto base = next(1);
  return number && base ? std::optional(*number * *base) : std::nullopt;
}

bool isLengthUnit(const StepStatement& unit) {
  const std::vector<std::string_view> arguments = stepArguments(unit.arguments);
  return arguments.size() > 1 && stepSymbol(arguments[1]) == "LENGTHUNIT";
}

}  // namespace

std::optional<double> ifcMetresPerUnit(const StepFile& file, bool& siUnit) {
  for (const StepStatement& assignment : file.statements()) {
    if (assignment.type != "IFCUNITASSIGNMENT") continue;
    for (const std::uint32_t id : stepReferences(assignment.arguments)) {
      const StepStatement* unit = file.find(id);
      if (unit == nullptr || !isLengthUnit(*unit)) continue;
      siUnit = unit->type == "IFCSIUNIT";
      const auto metres = metresIn(file, id);
      if (metres && *metres > 0) return metres;
    }
  }
  return std::nullopt;
}

/// IfcMapConversion (source, target, eastings, northings, height, x axis' abscissa and ordinate,
/// scale); its target is an IfcProjectedCRS (name, ..., the unit as seventh).
std::optional<IfcMapPlace> ifcMapPlace(const StepFile& file, double metresPerUnit) {
  constexpr double kFarthest = 1e9;  // metres: beyond any map
  for (const StepStatement& statement : file.statements()) {
    if (statement.type != "IFCMAPCONVERSION") continue;
    const std::vector<std::string_view> arguments = stepArguments(statement.arguments);
    const auto number = [&](std::size_t index, double otherwise) {
      if (index >= arguments.size()) return otherwise;
      return stepNumber(arguments[index]).value_or(otherwise);
    };
    IfcMapPlace place;
    double unit = metresPerUnit;
    const auto crs = arguments.size() > 1 ? stepReference(arguments[1]) : std::nullopt;
    if (const StepStatement* map = crs ? file.find(*crs) : nullptr) {
      const std::vector<std::string_view> told = stepArguments(map->arguments);
      if (!told.empty()) place.crs = stepText(told[0]).value_or("");
      const auto mapUnit = told.size() > 6 ? stepReference(told[6]) : std::nullopt;
      if (mapUnit) unit = metresIn(file, *mapUnit).value_or(unit);
    }
    place.east = unit * number(2, 0), place.north = unit * number(3, 0);
    place.height = unit * number(4, 0);
    const double alongEast = number(5, 1), alongNorth = number(6, 0);
    place.turn = std::atan2(alongNorth, alongEast);
    place.scale = number(7, 1);
    const double farthest =
        std::max({std::abs(place.east), std::abs(place.north), std::abs(place.height)});
    const bool onAMap = unit > 0 && farthest <= kFarthest && place.scale > 0 &&
                        place.scale <= kFarthest && (alongEast != 0 || alongNorth != 0);
    return onAMap ? std::optional(place) : std::nullopt;
  }
  return std::nullopt;
}

}  // namespace enfilade::scene
