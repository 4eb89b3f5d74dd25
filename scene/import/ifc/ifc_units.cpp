#include "scene/import/ifc/ifc_units.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <sstream>
#include <string_view>
#include <vector>

#include "collision/sine_cosine.hpp"
#include "scene/import/file/import_options.hpp"

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

/// The numbers of a georeference as the file states them.
struct MapNumbers {
  std::string source, crs;
  std::optional<double> unit;  ///< metres per unit of the map; nullopt: not stated
  double east = 0, north = 0, height = 0, xAxisEast = 1, xAxisNorth = 0, scale = 1;
  Eigen::Vector3d axisScale = Eigen::Vector3d::Ones();
  std::string fault;  ///< of the first number that cannot be read, or ""
};

using MapArguments = std::vector<std::string_view>;

/// `fallback` for a value that the file leaves out.
double parseMapNumber(std::string_view argument, const char* name, double fallback,
                      MapNumbers& numbers) {
  if (argument == "$" || argument == "*") return fallback;
  const auto number = parseStepNumber(argument);
  if (!number && numbers.fault.empty())
    numbers.fault = std::string("its ") + name + " '" + std::string(argument.substr(0, 40)) +
                    "' is not a number";
  return number.value_or(fallback);
}

double readMapNumber(const MapArguments& arguments, std::size_t index, const char* name,
                     double fallback, MapNumbers& numbers) {
  if (index >= arguments.size()) return fallback;
  return parseMapNumber(arguments[index], name, fallback, numbers);
}

/// The target of a conversion: an IfcProjectedCRS, whose first argument is the name, the seventh
/// the unit. Returns false for a system of angles.
bool readMapSystem(const StepFile& file, const MapArguments& arguments, MapNumbers& to) {
  const auto crs = arguments.size() > 1 ? parseStepReference(arguments[1]) : std::nullopt;
  const StepStatement* map = crs ? file.find(*crs) : nullptr;
  if (map == nullptr) return true;
  if (map->type == "IFCGEOGRAPHICCRS") return false;
  const MapArguments system = splitStepArguments(map->arguments);
  if (!system.empty()) to.crs = parseStepString(system[0]).value_or("");
  const auto unit = system.size() > 6 ? parseStepReference(system[6]) : std::nullopt;
  if (unit) to.unit = resolveMetres(file, *unit);
  return true;
}

/// IfcMapConversion (source, target, eastings, northings, height, x axis abscissa and ordinate,
/// scale) and IfcMapConversionScaled (.., factors of x, y and z).
std::optional<MapNumbers> readMapConversion(const StepFile& file) {
  for (const StepStatement& statement : file.statements()) {
    const bool scaled = statement.type == "IFCMAPCONVERSIONSCALED";
    if (!scaled && statement.type != "IFCMAPCONVERSION") continue;
    const MapArguments arguments = splitStepArguments(statement.arguments);
    MapNumbers numbers;
    const auto number = [&](std::size_t index, const char* name, double fallback) {
      return readMapNumber(arguments, index, name, fallback, numbers);
    };
    numbers.source = scaled ? "IfcMapConversionScaled" : "IfcMapConversion";
    if (!readMapSystem(file, arguments, numbers)) return std::nullopt;
    numbers.east = number(2, "Eastings", 0), numbers.north = number(3, "Northings", 0);
    numbers.height = number(4, "OrthogonalHeight", 0);
    numbers.xAxisEast = number(5, "XAxisAbscissa", 1);
    numbers.xAxisNorth = number(6, "XAxisOrdinate", 0);
    numbers.scale = number(7, "Scale", 1);
    if (scaled)
      numbers.axisScale = {number(8, "FactorX", 1), number(9, "FactorY", 1),
                           number(10, "FactorZ", 1)};
    return numbers;
  }
  return std::nullopt;
}

/// IfcRigidOperation (source, target, first and second coordinate, height): it does not rotate.
std::optional<MapNumbers> readRigidOperation(const StepFile& file) {
  for (const StepStatement& statement : file.statements()) {
    if (statement.type != "IFCRIGIDOPERATION") continue;
    const MapArguments arguments = splitStepArguments(statement.arguments);
    MapNumbers numbers;
    numbers.source = "IfcRigidOperation";
    if (arguments.size() < 4 || arguments[2].starts_with("IFCPLANEANGLEMEASURE") ||
        !readMapSystem(file, arguments, numbers))
      return std::nullopt;
    numbers.east = readMapNumber(arguments, 2, "FirstCoordinate", 0, numbers);
    numbers.north = readMapNumber(arguments, 3, "SecondCoordinate", 0, numbers);
    numbers.height = readMapNumber(arguments, 4, "Height", 0, numbers);
    return numbers;
  }
  return std::nullopt;
}

std::string toUpperCase(std::string text) {
  for (char& letter : text)
    if (letter >= 'a' && letter <= 'z') letter = static_cast<char>(letter - 'a' + 'A');
  return text;
}

/// The single values of the first property set of this name, by their names; both in upper case.
/// Writers differ in capitals: ePSet, ePset.
std::map<std::string, std::string_view> readPropertySet(const StepFile& file,
                                                        const std::string& name) {
  std::map<std::string, std::string_view> values;
  for (const StepStatement& statement : file.statements()) {
    if (statement.type != "IFCPROPERTYSET") continue;
    const MapArguments set = splitStepArguments(statement.arguments);
    if (set.size() < 5 || toUpperCase(parseStepString(set[2]).value_or("")) != name) continue;
    for (const std::uint32_t id : parseStepReferences(set[4])) {
      const StepStatement* property = file.findOfType(id, "IFCPROPERTYSINGLEVALUE");
      if (property == nullptr) continue;
      const MapArguments single = splitStepArguments(property->arguments);
      if (single.size() > 2)
        values.emplace(toUpperCase(parseStepString(single[0]).value_or("")), single[2]);
    }
    return values;
  }
  return values;
}

/// A text such as IFCLABEL('EPSG:25832').
std::string parseLabel(std::string_view value) {
  const std::size_t open = value.find('('), close = value.rfind(')');
  if (open != std::string_view::npos && close != std::string_view::npos && open < close)
    value = value.substr(open + 1, close - open - 1);
  return parseStepString(value).value_or("");
}

/// The names of units that property sets give as texts.
std::optional<double> parseUnitName(const std::string& name) {
  static const std::map<std::string, double> kUnits{
      {"METRE", 1},          {"METER", 1},        {"M", 1},
      {"MILLIMETRE", 0.001}, {"MM", 0.001},       {"CENTIMETRE", 0.01},
      {"FOOT", 0.3048},      {"FEET", 0.3048},    {"FT", 0.3048},
      {"INCH", 0.0254},      {"KILOMETRE", 1000}, {"US SURVEY FOOT", 1200.0 / 3937}};
  const auto unit = kUnits.find(toUpperCase(name));
  return unit == kUnits.end() ? std::nullopt : std::optional(unit->second);
}

/// IFC2x3 has no entity for maps; buildingSMART's guide to georeferencing gives it property sets.
std::optional<MapNumbers> readMapProperties(const StepFile& file) {
  const auto values = readPropertySet(file, "EPSET_MAPCONVERSION");
  if (!values.contains("EASTINGS") || !values.contains("NORTHINGS")) return std::nullopt;
  MapNumbers numbers;
  const auto number = [&](const char* name, double fallback) {
    const auto value = values.find(name);
    return value == values.end() ? fallback
                                 : parseMapNumber(value->second, name, fallback, numbers);
  };
  const auto system = readPropertySet(file, "EPSET_PROJECTEDCRS");
  const auto text = [&](const char* name) {
    const auto value = system.find(name);
    return value == system.end() ? std::string() : parseLabel(value->second);
  };
  numbers.source = "ePSet_MapConversion";
  numbers.crs = text("NAME");
  if (const auto target = values.find("TARGETCRS"); numbers.crs.empty() && target != values.end())
    numbers.crs = parseLabel(target->second);
  numbers.unit = parseUnitName(text("MAPUNIT"));
  numbers.east = number("EASTINGS", 0), numbers.north = number("NORTHINGS", 0);
  numbers.height = number("ORTHOGONALHEIGHT", 0);
  numbers.xAxisEast = number("XAXISABSCISSA", 1), numbers.xAxisNorth = number("XAXISORDINATE", 0);
  numbers.scale = number("SCALE", 1);
  return numbers;
}

constexpr double kMaxMapCoordinate = 1e9;  // metres; larger than any map

/// "" for numbers that place the file on a map; otherwise the first fault, as "its .. is ..".
std::string findMapFault(const MapNumbers& numbers, const IfcMapConversion& conversion,
                         double unit) {
  if (!numbers.fault.empty()) return numbers.fault;
  const double maxCoordinate = std::max(
      {std::abs(conversion.east), std::abs(conversion.north), std::abs(conversion.height)});
  if (!(unit > 0)) return "the unit of its map is not positive";
  if (!(maxCoordinate <= kMaxMapCoordinate)) return "its origin lies beyond any map";
  if (numbers.xAxisEast == 0 && numbers.xAxisNorth == 0)
    return "its x axis has no direction (0, 0)";
  if (!(conversion.scale > 0 && conversion.scale <= kMaxMapCoordinate))
    return "its scale is not a positive number that a map can have";
  const bool isScaled = conversion.axisScale.minCoeff() > 0 && conversion.axisScale.allFinite();
  return isScaled ? "" : "the factor of an axis is not positive";
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

std::optional<IfcMapConversion> readIfcMapConversion(const StepFile& file, double metresPerUnit,
                                                     std::string& fault) {
  std::optional<MapNumbers> numbers = readMapConversion(file);
  if (!numbers) numbers = readRigidOperation(file);
  if (!numbers) numbers = readMapProperties(file);
  if (!numbers) return std::nullopt;
  const double scale = numbers->scale > 0 ? numbers->scale : 1;  // its sign is a fault
  // Without a unit of its own the map has that of the file, unless the scale leads to metres.
  const bool inFileUnits = computeMapScale(scale, 1 / metresPerUnit) == scale;
  const double unit = numbers->unit.value_or(inFileUnits ? metresPerUnit : 1);
  IfcMapConversion conversion;
  conversion.source = numbers->source;
  conversion.crs = numbers->crs;
  conversion.east = unit * numbers->east, conversion.north = unit * numbers->north;
  conversion.height = unit * numbers->height;
  const double xAxisEast = numbers->xAxisEast, xAxisNorth = numbers->xAxisNorth;
  conversion.rotation = std::atan2(xAxisNorth, xAxisEast);
  const double length = std::sqrt(xAxisEast * xAxisEast + xAxisNorth * xAxisNorth);
  if (length > 0) {
    conversion.xAxisEast = xAxisEast / length;
    conversion.xAxisNorth = xAxisNorth / length;
  }
  // A rigid operation keeps lengths; in other units they are the same metres.
  if (numbers->source != "IfcRigidOperation")
    conversion.scale =
        numbers->scale > 0 ? computeMapScale(scale, unit / metresPerUnit) : numbers->scale;
  conversion.axisScale = numbers->axisScale;
  const std::string found = findMapFault(*numbers, conversion, unit);
  if (found.empty()) return conversion;
  fault = numbers->source + ": " + found;
  return std::nullopt;
}

Eigen::Affine3d computeMapFromFile(const IfcMapConversion& conversion) {
  Eigen::Affine3d map = Eigen::Affine3d::Identity();
  map.linear() << conversion.xAxisEast, -conversion.xAxisNorth, 0, conversion.xAxisNorth,
      conversion.xAxisEast, 0, 0, 0, 1;
  map.linear() *= conversion.scale;
  map.linear() = map.linear() * conversion.axisScale.asDiagonal();
  map.translation() = Eigen::Vector3d(conversion.east, conversion.north, conversion.height);
  return map;
}

Eigen::Vector3d computeGridNorth(const IfcMapConversion& conversion) {
  return {conversion.xAxisNorth, conversion.xAxisEast, 0};
}

std::string formatMapConversion(const IfcMapConversion& conversion) {
  char text[160];
  std::snprintf(text, sizeof text,
                "the file's origin is at E %.3f, N %.3f, H %.3f m, its x axis %.6f degrees from "
                "east to north, scale %.9g",
                conversion.east, conversion.north, conversion.height,
                conversion.rotation * collision::kDegreesPerRadian, conversion.scale);
  return (conversion.crs.empty() ? "unnamed map" : conversion.crs) + ": " + text;
}

const IfcMapConversion& requireMap(const std::optional<IfcMapConversion>& conversion,
                                   const std::string& fault) {
  if (!fault.empty())
    throw ImportError("--georeference: " + fault +
                      "; leave the option out, or correct it in the program that wrote the file");
  if (!conversion)
    throw ImportError(
        "--georeference: the file has no IfcMapConversion, IfcRigidOperation or "
        "ePSet_MapConversion in metres; leave the option out, or export the file with its map");
  // Coordinates of another size than a projection's are not what was meant.
  const double min = conversion->scale * conversion->axisScale.minCoeff();
  const double max = conversion->scale * conversion->axisScale.maxCoeff();
  if (min >= 0.5 && max <= 2) return *conversion;
  std::ostringstream scale;
  scale << (max > 2 ? max : min);
  throw ImportError("--georeference: its " + conversion->source + " scales by " + scale.str() +
                    "; leave the option out, or correct its Scale, which converts from the file's "
                    "length unit to the map's");
}

}  // namespace enfilade::scene
