#include "scene/import/ifc/ifc_units.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <vector>

namespace enfilade::scene {
namespace {

constexpr int kMaxUnitDepth = 4;  // conversions from a unit to its SI unit

std::optional<double> parseSiPrefix(std::string_view argument) {
  static const std::map<std::string_view, double> kPrefixes{
      {"EXA", 1e18},  {"PETA", 1e15},  {"TERA", 1e12},   {"GIGA", 1e9},
      {"MEGA", 1e6},  {"KILO", 1e3},   {"HECTO", 1e2},   {"DECA", 1e1},
      {"DECI", 1e-1}, {"CENTI", 1e-2}, {"MILLI", 1e-3},  {"MICRO", 1e-6},
      {"NANO", 1e-9}, {"PICO", 1e-12}, {"FEMTO", 1e-15}, {"ATTO", 1e-18}};
  if (argument == "$") return 1;
  const auto prefix = kPrefixes.find(parseStepEnum(argument));
  return prefix == kPrefixes.end() ? std::nullopt : std::optional(prefix->second);
}

/// Metres per unit; a conversion-based unit is a multiple of another. The recursion is bounded,
/// because a broken file may contain a cycle.
std::optional<double> resolveMetres(const StepFile& file, std::uint32_t id,
                                    int depthLeft = kMaxUnitDepth) {
  const StepStatement* unit = file.find(id);
  if (unit == nullptr || depthLeft == 0) return std::nullopt;
  const std::vector<std::string_view> arguments = splitStepArguments(unit->arguments);
  if (unit->type == "IFCSIUNIT" && arguments.size() == 4) return parseSiPrefix(arguments[2]);
  const auto next = [&](std::size_t index) -> std::optional<double> {
    const auto reference =
        index < arguments.size() ? parseStepReference(arguments[index]) : std::nullopt;
    return reference ? resolveMetres(file, *reference, depthLeft - 1) : std::nullopt;
  };
  // (dimensions, type, name, factor) and (number, unit)
  if (unit->type.starts_with("IFCCONVERSIONBASEDUNIT")) return next(3);
  if (unit->type != "IFCMEASUREWITHUNIT" || arguments.size() != 2) return std::nullopt;
  const auto number = parseStepNumber(arguments[0]);
  const auto base = next(1);
  return number && base ? std::optional(*number * *base) : std::nullopt;
}

bool isLengthUnit(const StepStatement& unit) {
  const std::vector<std::string_view> arguments = splitStepArguments(unit.arguments);
  return arguments.size() > 1 && parseStepEnum(arguments[1]) == "LENGTHUNIT";
}

/// From metres of the file to metres of the map. `mapUnits`: units of the file in one of the map.
/// By the standard the file's scale also converts between the units. Many exporters write the pure
/// factor (1, or the projection's) all the same, so the reading nearer to 1 is taken.
double computeMapScale(double scale, double mapUnits) {
  const double converted = scale * mapUnits;
  return std::abs(std::log(converted)) < std::abs(std::log(scale)) ? converted : scale;
}

}  // namespace

std::optional<double> readIfcMetresPerUnit(const StepFile& file, bool& siUnit) {
  for (const StepStatement& assignment : file.statements()) {
    if (assignment.type != "IFCUNITASSIGNMENT") continue;
    for (const std::uint32_t id : parseStepReferences(assignment.arguments)) {
      const StepStatement* unit = file.find(id);
      if (unit == nullptr || !isLengthUnit(*unit)) continue;
      siUnit = unit->type == "IFCSIUNIT";
      const auto metres = resolveMetres(file, id);
      if (metres && *metres > 0) return metres;
    }
  }
  return std::nullopt;
}

/// IfcMapConversion (source, target, eastings, northings, height, x axis abscissa and ordinate,
/// scale); its target is an IfcProjectedCRS, whose first argument is the name, the seventh the
/// unit.
std::optional<IfcMapConversion> readIfcMapConversion(const StepFile& file, double metresPerUnit) {
  constexpr double kMaxCoordinate = 1e9;  // metres; larger than any map
  for (const StepStatement& statement : file.statements()) {
    if (statement.type != "IFCMAPCONVERSION") continue;
    const std::vector<std::string_view> arguments = splitStepArguments(statement.arguments);
    const auto number = [&](std::size_t index, double fallback) {
      if (index >= arguments.size()) return fallback;
      return parseStepNumber(arguments[index]).value_or(fallback);
    };
    IfcMapConversion conversion;
    const double scale = number(7, 1);
    // Without a unit of its own the map has that of the file, unless the scale leads to metres.
    double unit = computeMapScale(scale, 1 / metresPerUnit) == scale ? metresPerUnit : 1;
    const auto crs = arguments.size() > 1 ? parseStepReference(arguments[1]) : std::nullopt;
    if (const StepStatement* map = crs ? file.find(*crs) : nullptr) {
      const std::vector<std::string_view> crsArguments = splitStepArguments(map->arguments);
      if (!crsArguments.empty()) conversion.crs = parseStepString(crsArguments[0]).value_or("");
      const auto mapUnit =
          crsArguments.size() > 6 ? parseStepReference(crsArguments[6]) : std::nullopt;
      if (mapUnit) unit = resolveMetres(file, *mapUnit).value_or(unit);
    }
    conversion.east = unit * number(2, 0), conversion.north = unit * number(3, 0);
    conversion.height = unit * number(4, 0);
    const double xAxisEast = number(5, 1), xAxisNorth = number(6, 0);
    conversion.rotation = std::atan2(xAxisNorth, xAxisEast);
    const double length = std::sqrt(xAxisEast * xAxisEast + xAxisNorth * xAxisNorth);
    if (length > 0) {
      conversion.xAxisEast = xAxisEast / length;
      conversion.xAxisNorth = xAxisNorth / length;
    }
    conversion.scale = computeMapScale(scale, unit / metresPerUnit);
    const double maxCoordinate = std::max(
        {std::abs(conversion.east), std::abs(conversion.north), std::abs(conversion.height)});
    const bool isValid = unit > 0 && maxCoordinate <= kMaxCoordinate && conversion.scale > 0 &&
                         conversion.scale <= kMaxCoordinate && (xAxisEast != 0 || xAxisNorth != 0);
    return isValid ? std::optional(conversion) : std::nullopt;
  }
  return std::nullopt;
}

Eigen::Affine3d computeMapFromFile(const IfcMapConversion& conversion) {
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() << conversion.xAxisEast, -conversion.xAxisNorth, 0, conversion.xAxisNorth,
      conversion.xAxisEast, 0, 0, 0, 1;
  map.linear() *= conversion.scale;
  map.translation() = Eigen::Vector3d(conversion.east, conversion.north, conversion.height);
  return map;
}

}  // namespace enfilade::scene
