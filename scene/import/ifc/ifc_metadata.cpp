#include "scene/import/ifc/ifc_metadata.hpp"

#include <algorithm>
#include <set>
#include <string_view>

#include "scene/import/assembly/path_names.hpp"
#include "scene/import/ifc/class_names.hpp"
#include "scene/model/add_diagnostic.hpp"

namespace enfilade::scene {
namespace {

constexpr int kMaxPlacementDepth = 200;  // nesting of relative placements
constexpr int kMaxMappingDepth = 8;      // nesting of mapped representations

using Arguments = std::vector<std::string_view>;

std::string_view getArgument(const Arguments& arguments, std::size_t index) {
  return index < arguments.size() ? arguments[index] : std::string_view("$");
}

// ---- placements ---------------------------------------------------------------------------------

std::optional<Vec3> readStepVector(const StepFile& file, std::string_view argument,
                                   std::string_view type) {
  const auto id = parseStepReference(argument);
  const StepStatement* statement = id ? file.findOfType(*id, type) : nullptr;
  if (statement == nullptr) return std::nullopt;
  const std::vector<double> numbers =
      parseStepNumbers(getArgument(splitStepArguments(statement->arguments), 0));
  if (numbers.size() < 2) return std::nullopt;
  return Vec3(numbers[0], numbers[1], numbers.size() > 2 ? numbers[2] : 0);
}

Vec3 normalizeOr(const std::optional<Vec3>& direction, const Vec3& fallback) {
  const bool usable = direction && direction->norm() > 0 && direction->allFinite();
  return usable ? direction->normalized() : fallback;
}

/// IfcAxis2Placement3D (location, z, x) or 2D (location, x), in metres.
std::optional<Eigen::Affine3d> readAxisPlacement(const StepFile& file, std::uint32_t id,
                                                 double metresPerUnit) {
  const StepStatement* statement = file.find(id);
  if (statement == nullptr) return std::nullopt;
  const Arguments arguments = splitStepArguments(statement->arguments);
  const auto origin = readStepVector(file, getArgument(arguments, 0), "IFCCARTESIANPOINT");
  if (!origin) return std::nullopt;
  const bool flat = statement->type == "IFCAXIS2PLACEMENT2D";
  const auto direction = [&](std::size_t index) {
    return readStepVector(file, getArgument(arguments, index), "IFCDIRECTION");
  };
  const Vec3 z = flat ? Vec3(Vec3::UnitZ()) : normalizeOr(direction(1), Vec3::UnitZ());
  // Without an x direction: the projection of the file's x axis, or of z if x is the placement's z.
  Vec3 x =
      normalizeOr(direction(flat ? 1 : 2), std::abs(z.x()) > 0.99 ? Vec3::UnitZ() : Vec3::UnitX());
  x = normalizeOr(x - x.dot(z) * z, Vec3(z.y(), z.z(), z.x()).cross(z).normalized());
  Eigen::Affine3d placement = Eigen::Affine3d::Identity();
  placement.linear().col(0) = x;
  placement.linear().col(1) = z.cross(x);
  placement.linear().col(2) = z;
  placement.translation() = *origin * metresPerUnit;
  return placement;
}

/// The placement that a placement is relative to; nullopt: none.
std::optional<std::uint32_t> findParentPlacement(const StepFile& file, std::uint32_t placement) {
  const StepStatement* statement = file.findOfType(placement, "IFCLOCALPLACEMENT");
  if (statement == nullptr) return std::nullopt;
  return parseStepReference(getArgument(splitStepArguments(statement->arguments), 0));
}

bool isEndlessPlacement(const StepFile& file, std::uint32_t placement) {
  std::optional<std::uint32_t> next = placement;
  for (int depth = 0; next && depth < kMaxPlacementDepth; ++depth)
    next = findParentPlacement(file, *next);
  return next.has_value();
}

/// TrueNorth of an IfcGeometricRepresentationContext (identifier, type, dimensions, precision,
/// placement, true north). It refers to the axes of the placement. Contexts of three dimensions
/// come first. `unstated`: the direction in a context that states none; nullopt: none. Those that
/// cannot be used, before the one that is, are added to `problems`.
std::optional<Vec3> readTrueNorth(const StepFile& file, const std::optional<Vec3>& unstated,
                                  std::vector<Diagnostic>& problems) {
  std::optional<Vec3> flat;
  constexpr std::size_t kMaxShownBytes = 80;
  const auto report = [&](const StepStatement& context, std::string_view stated) {
    addDiagnostic(problems, "broken_north",
                  "#" + std::to_string(context.id) + ": TrueNorth " +
                      encodePathSegment(stated.substr(0, kMaxShownBytes)));
  };
  for (const StepStatement& statement : file.statements()) {
    if (statement.type != "IFCGEOMETRICREPRESENTATIONCONTEXT") continue;
    const Arguments arguments = splitStepArguments(statement.arguments);
    const std::string_view stated = getArgument(arguments, 5);
    const bool isStated = !stated.empty() && stated != "$" && stated != "*";
    const auto direction = isStated ? readStepVector(file, stated, "IFCDIRECTION") : unstated;
    if (!direction) {
      if (isStated) report(statement, stated);
      continue;
    }
    Vec3 north = *direction;
    const auto placement = parseStepReference(getArgument(arguments, 4));
    if (const auto axes = placement ? readAxisPlacement(file, *placement, 1) : std::nullopt)
      north = axes->linear() * north;
    north.z() = 0;
    if (!north.allFinite() || !(north.norm() > 1e-9)) {
      if (isStated) report(statement, stated);
      continue;
    }
    if (parseStepNumber(getArgument(arguments, 2)) == 3) return north.normalized();
    if (!flat) flat = north.normalized();
  }
  return flat;
}

// ---- bodies -------------------------------------------------------------------------------------

/// Whether a representation declares triangles. Identifiers vary between exporters, so known
/// drawings are excluded and everything else counts as a body.
bool isBodyRepresentation(const StepFile& file, std::uint32_t representation, int depth) {
  const StepStatement* statement = file.find(representation);
  if (statement == nullptr || depth == 0) return false;
  const Arguments arguments = splitStepArguments(statement->arguments);
  const std::string identifier = parseStepString(getArgument(arguments, 1)).value_or("");
  const std::string type = parseStepString(getArgument(arguments, 2)).value_or("");
  static const std::set<std::string> kDrawings{
      "Axis",      "Box",       "FootPrint",  "Annotation", "Plan", "Profile",
      "Reference", "Clearance", "CoG",        "Lighting",   "Path", "SurveyPoints",
      "Elevation", "Point",     "Centerline", "Boundary",   "Curve"};
  static const std::set<std::string> kFlatTypes{
      "Curve2D",      "Curve3D",     "Curve",   "GeometricCurveSet", "Annotation2D",
      "BoundingBox",  "PointCloud",  "Point",   "FillArea",          "Text",
      "GeometricSet", "LightSource", "Segment", "Surface2D",         "Edge",
      "Vertex",       "StyledItem"};
  if (kDrawings.contains(identifier) || kFlatTypes.contains(type)) return false;
  if (type != "MappedRepresentation")
    return !parseStepReferences(getArgument(arguments, 3)).empty();
  for (const std::uint32_t item : parseStepReferences(getArgument(arguments, 3))) {
    const StepStatement* mapped = file.findOfType(item, "IFCMAPPEDITEM");
    const auto source =
        mapped == nullptr
            ? std::nullopt
            : parseStepReference(getArgument(splitStepArguments(mapped->arguments), 0));
    const StepStatement* map = source ? file.findOfType(*source, "IFCREPRESENTATIONMAP") : nullptr;
    const auto inner = map == nullptr
                           ? std::nullopt
                           : parseStepReference(getArgument(splitStepArguments(map->arguments), 1));
    if (inner && isBodyRepresentation(file, *inner, depth - 1)) return true;
  }
  return false;
}

bool hasBodyRepresentation(const StepFile& file, std::string_view representation) {
  const auto id = parseStepReference(representation);
  const StepStatement* shape = id ? file.find(*id) : nullptr;
  if (shape == nullptr) return false;
  const std::vector<std::uint32_t> all =
      parseStepReferences(getArgument(splitStepArguments(shape->arguments), 2));
  return std::any_of(all.begin(), all.end(), [&](std::uint32_t one) {
    return isBodyRepresentation(file, one, kMaxMappingDepth);
  });
}

// ---- products -----------------------------------------------------------------------------------

IfcProduct::Role classifyRole(std::string_view type) {
  using Role = IfcProduct::Role;
  static const std::map<std::string_view, Role> kAir{{"IFCSPACE", Role::space},
                                                     {"IFCSPATIALZONE", Role::space},
                                                     {"IFCEXTERNALSPATIALELEMENT", Role::space},
                                                     {"IFCOPENINGELEMENT", Role::opening},
                                                     {"IFCOPENINGSTANDARDCASE", Role::opening},
                                                     {"IFCVOIDINGFEATURE", Role::opening},
                                                     {"IFCEDGEFEATURE", Role::opening},
                                                     {"IFCCHAMFEREDGEFEATURE", Role::opening},
                                                     {"IFCROUNDEDEDGEFEATURE", Role::opening},
                                                     {"IFCVIRTUALELEMENT", Role::opening},
                                                     {"IFCANNOTATION", Role::drawing},
                                                     {"IFCGRID", Role::drawing},
                                                     {"IFCPORT", Role::drawing},
                                                     {"IFCDISTRIBUTIONPORT", Role::drawing},
                                                     {"IFCREFERENT", Role::drawing},
                                                     {"IFCALIGNMENT", Role::drawing},
                                                     {"IFCSURFACEFEATURE", Role::drawing}};
  if (type.starts_with("IFCSTRUCTURAL")) return Role::drawing;  // structural analysis models
  const auto air = kAir.find(type);
  return air == kAir.end() ? Role::physical : air->second;
}

bool isGlobalId(std::string_view text) {
  return text.size() == 24 && text.front() == '\'' && text.back() == '\'';
}

/// Recognises a product by its arguments (GlobalId, owner, name, description, object type,
/// placement, representation, ...), so that classes of later schemas are products, too.
bool isProduct(const StepFile& file, const Arguments& arguments) {
  if (arguments.size() < 7 || !isGlobalId(arguments[0])) return false;
  const auto referred = [&](std::size_t index) -> std::string_view {
    const auto id = parseStepReference(arguments[index]);
    const StepStatement* statement = id ? file.find(*id) : nullptr;
    return statement == nullptr ? std::string_view() : statement->type;
  };
  const std::string_view placement = referred(5), shape = referred(6);
  const bool placed = placement.ends_with("PLACEMENT");
  const bool shaped = shape == "IFCPRODUCTDEFINITIONSHAPE" || shape == "IFCPRODUCTREPRESENTATION";
  return (placed || arguments[5] == "$") && (shaped || arguments[6] == "$") && (placed || shaped);
}

void readSizes(const Arguments& arguments, double metresPerUnit, IfcProduct& product) {
  product.overallHeight = parseStepNumber(getArgument(arguments, 8)).value_or(0) * metresPerUnit;
  product.overallWidth = parseStepNumber(getArgument(arguments, 9)).value_or(0) * metresPerUnit;
  const auto sane = [](double length) { return length > 0 && length < 1e4 ? length : 0; };
  product.overallHeight = sane(product.overallHeight);
  product.overallWidth = sane(product.overallWidth);
}

bool isDoor(std::string_view type) {
  return type.starts_with("IFCDOOR");
}
bool isWindow(std::string_view type) {
  return type.starts_with("IFCWINDOW");
}

/// The operation stated by the product itself; its type may state it instead.
std::string readOwnOperation(std::string_view type, const Arguments& arguments) {
  std::size_t index = 0;
  if (isDoor(type) || isWindow(type)) index = 11;  // IFC4
  if (type == "IFCTRANSPORTELEMENT" || type == "IFCTRANSPORTATIONDEVICE") index = 8;
  return index == 0 ? std::string() : std::string(parseStepEnum(getArgument(arguments, index)));
}

std::string readTypeOperation(const StepStatement& type) {
  static const std::map<std::string_view, std::size_t> kArgumentIndex{
      {"IFCDOORSTYLE", 8},   {"IFCDOORTYPE", 10},   {"IFCTRANSPORTELEMENTTYPE", 9},
      {"IFCWINDOWSTYLE", 9}, {"IFCWINDOWTYPE", 10}, {"IFCTRANSPORTATIONDEVICETYPE", 9}};
  const auto where = kArgumentIndex.find(type.type);
  if (where == kArgumentIndex.end()) return {};
  return std::string(parseStepEnum(getArgument(splitStepArguments(type.arguments), where->second)));
}

class IfcMetadataReader {
 public:
  explicit IfcMetadataReader(const StepFile& file) : file_(file) {}

  IfcMetadata read() {
    readUnit();
    for (const StepStatement& statement : file_.statements()) readStatement(statement);
    for (const StepStatement& statement : file_.statements()) readRelation(statement);
    for (IfcProduct& product : metadata_.products) {
      const auto host = hostOfOpening_.find(product.opening);
      if (host != hostOfOpening_.end()) product.host = host->second;
    }
    return std::move(metadata_);
  }

 private:
  void readUnit() {
    metadata_.schema = file_.schema();
    metadata_.complete = file_.hasEnd();
    if (const auto metres = readIfcMetresPerUnit(file_, metadata_.siUnit)) {
      metadata_.metresPerUnit = *metres;
    } else {
      metadata_.unitAssumption = "no length unit in IFCUNITASSIGNMENT: metres assumed";
    }
    metadata_.mapConversion =
        readIfcMapConversion(file_, metadata_.metresPerUnit, metadata_.mapFault);
    metadata_.trueNorth = readTrueNorth(file_, std::nullopt, metadata_.diagnostics);
    if (!metadata_.trueNorth && metadata_.mapConversion)
      metadata_.trueNorth = computeGridNorth(*metadata_.mapConversion);
    // IFC says that y points to north in a context that states nothing else.
    std::vector<Diagnostic> ignored;  // they were reported above
    if (!metadata_.trueNorth && metadata_.mapFault.empty())
      metadata_.trueNorth = readTrueNorth(file_, Vec3::UnitY(), ignored);
  }

  void readStatement(const StepStatement& statement) {
    const std::size_t quote = statement.arguments.find_first_not_of(" \t\r\n");
    if (quote == std::string_view::npos || statement.arguments[quote] != '\'') return;
    const Arguments arguments = splitStepArguments(statement.arguments);
    if (statement.type == "IFCPROJECT") {
      metadata_.projects[statement.id] = parseStepString(getArgument(arguments, 2)).value_or("");
      return;
    }
    if (!isProduct(file_, arguments)) return;
    IfcProduct product;
    product.id = statement.id;
    product.role = classifyRole(statement.type);
    product.hasBody = hasBodyRepresentation(file_, arguments[6]);
    product.globalId = parseStepString(arguments[0]).value_or("");
    product.ifcClass = formatIfcClassName(statement.type);
    product.name = parseStepString(arguments[2]).value_or("");
    product.operation = readOwnOperation(statement.type, arguments);
    if (isDoor(statement.type) || isWindow(statement.type)) {
      readSizes(arguments, metadata_.metresPerUnit, product);
    }
    readSpatialElement(statement.type, arguments, product);
    if (const auto placement = parseStepReference(arguments[5])) {
      product.fileFromPlacement = readIfcPlacement(file_, *placement, metadata_.metresPerUnit);
      if (!product.fileFromPlacement && isEndlessPlacement(file_, *placement))
        addDiagnostic(metadata_.diagnostics, "broken_transform_dropped",
                      product.globalId + " (" + product.ifcClass +
                          "): its placement is relative to itself, or nested more than 200 deep");
    }
    if (!metadata_.byId.emplace(product.id, metadata_.products.size()).second) return;
    metadata_.products.push_back(std::move(product));
  }

  void readSpatialElement(std::string_view type, const Arguments& arguments, IfcProduct& product) {
    const bool isStorey = type == "IFCBUILDINGSTOREY";
    if (!isStorey && product.role != IfcProduct::Role::space) return;
    product.longName = parseStepString(getArgument(arguments, 7)).value_or("");
    if (!isStorey) return;
    const std::string_view stated = getArgument(arguments, 9);
    const std::optional<double> elevation = parseStepNumber(stated);
    if (!elevation && stated != "$" && !stated.empty())
      addDiagnostic(metadata_.diagnostics, "broken_elevation",
                    product.globalId + " (" + product.name + "): " + std::string(stated));
    product.elevation = elevation.value_or(0) * metadata_.metresPerUnit;
  }

  /// Arguments of every relation: (GlobalId, owner, name, description, one side, other side).
  void readRelation(const StepStatement& statement) {
    if (!statement.type.starts_with("IFCREL")) return;
    const Arguments arguments = splitStepArguments(statement.arguments);
    const auto forEachRelated = [&](std::size_t one, std::size_t many, auto visit) {
      const auto id = parseStepReference(getArgument(arguments, one));
      if (!id) return;
      for (const std::uint32_t other : parseStepReferences(getArgument(arguments, many)))
        visit(*id, other);
    };
    const auto setParent = [&](std::uint32_t parent, std::uint32_t child) {
      if (const auto product = metadata_.byId.find(child); product != metadata_.byId.end()) {
        std::uint32_t& known = metadata_.products[product->second].parent;
        if (known == 0) known = parent;
      }
    };
    if (statement.type == "IFCRELAGGREGATES" || statement.type == "IFCRELNESTS") {
      forEachRelated(4, 5, setParent);
    } else if (statement.type == "IFCRELCONTAINEDINSPATIALSTRUCTURE") {
      forEachRelated(5, 4, setParent);
    } else if (statement.type == "IFCRELVOIDSELEMENT") {
      forEachRelated(4, 5, [&](std::uint32_t host, std::uint32_t opening) {
        hostOfOpening_.emplace(opening, host);
      });
    } else if (statement.type == "IFCRELFILLSELEMENT") {
      forEachRelated(4, 5, [&](std::uint32_t opening, std::uint32_t filling) {
        const auto product = metadata_.byId.find(filling);
        if (product != metadata_.byId.end()) metadata_.products[product->second].opening = opening;
      });
    } else if (statement.type == "IFCRELDEFINESBYTYPE") {
      forEachRelated(5, 4,
                     [&](std::uint32_t type, std::uint32_t id) { applyTypeOperation(type, id); });
    }
  }

  void applyTypeOperation(std::uint32_t type, std::uint32_t id) {
    const StepStatement* statement = file_.find(type);
    const auto product = metadata_.byId.find(id);
    if (statement == nullptr || product == metadata_.byId.end()) return;
    std::string& operation = metadata_.products[product->second].operation;
    const bool open = operation.empty() || operation == "NOTDEFINED";
    const std::string typeOperation = readTypeOperation(*statement);
    if (open && !typeOperation.empty()) operation = typeOperation;
  }

  const StepFile& file_;
  IfcMetadata metadata_;
  std::map<std::uint32_t, std::uint32_t> hostOfOpening_;
};

}  // namespace

const IfcProduct* IfcMetadata::find(std::uint32_t id) const {
  const auto found = byId.find(id);
  return found == byId.end() ? nullptr : &products[found->second];
}

std::optional<Eigen::Affine3d> readIfcPlacement(const StepFile& file, std::uint32_t placement,
                                                double metresPerUnit) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  std::optional<std::uint32_t> next = placement;
  for (int depth = 0; next && depth < kMaxPlacementDepth; ++depth) {
    const StepStatement* statement = file.findOfType(*next, "IFCLOCALPLACEMENT");
    if (statement == nullptr) return std::nullopt;
    const Arguments arguments = splitStepArguments(statement->arguments);
    const auto relative = parseStepReference(getArgument(arguments, 1));
    const auto local = relative ? readAxisPlacement(file, *relative, metresPerUnit) : std::nullopt;
    if (!local) return std::nullopt;
    result = *local * result;
    next = parseStepReference(getArgument(arguments, 0));
  }
  if (next || !result.matrix().allFinite()) return std::nullopt;
  return result;
}

IfcMetadata readIfcMetadata(const StepFile& file) {
  return IfcMetadataReader(file).read();
}

}  // namespace enfilade::scene
