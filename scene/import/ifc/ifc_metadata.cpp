#include "scene/import/ifc/ifc_metadata.hpp"

#include <algorithm>
#include <set>

namespace enfilade::scene {
namespace {

constexpr int kDeepestPlacement = 200;  // placements relative to one another
constexpr int kDeepestMapping = 8;      // representations that map representations

using Arguments = std::vector<std::string_view>;

std::string_view at(const Arguments& arguments, std::size_t index) {
  return index < arguments.size() ? arguments[index] : std::string_view("$");
}

// ---- placements ---------------------------------------------------------------------------------

std::optional<Vec3> vectorOf(const StepFile& file, std::string_view argument,
                             std::string_view type) {
  const auto id = stepReference(argument);
  const StepStatement* statement = id ? file.find(*id, type) : nullptr;
  if (statement == nullptr) return std::nullopt;
  const std::vector<double> numbers = stepNumbers(at(stepArguments(statement->arguments), 0));
  if (numbers.size() < 2) return std::nullopt;
  return Vec3(numbers[0], numbers[1], numbers.size() > 2 ? numbers[2] : 0);
}

Vec3 unitOr(const std::optional<Vec3>& direction, const Vec3& otherwise) {
  const bool usable = direction && direction->norm() > 0 && direction->allFinite();
  return usable ? direction->normalized() : otherwise;
}

/// IfcAxis2Placement3D (location, z, x) or 2D (location, x), in metres.
std::optional<Eigen::Affine3d> axisPlacement(const StepFile& file, std::uint32_t id,
                                             double metresPerUnit) {
  const StepStatement* statement = file.find(id);
  if (statement == nullptr) return std::nullopt;
  const Arguments arguments = stepArguments(statement->arguments);
  const auto origin = vectorOf(file, at(arguments, 0), "IFCCARTESIANPOINT");
  if (!origin) return std::nullopt;
  const bool flat = statement->type == "IFCAXIS2PLACEMENT2D";
  const auto direction = [&](std::size_t index) {
    return vectorOf(file, at(arguments, index), "IFCDIRECTION");
  };
  const Vec3 z = flat ? Vec3(Vec3::UnitZ()) : unitOr(direction(1), Vec3::UnitZ());
  // Without a direction of x: the projection of the file's x, or of z where that is the axis.
  Vec3 x = unitOr(direction(flat ? 1 : 2), std::abs(z.x()) > 0.99 ? Vec3::UnitZ() : Vec3::UnitX());
  x = unitOr(x - x.dot(z) * z, Vec3(z.y(), z.z(), z.x()).cross(z).normalized());
  Eigen::Affine3d placement = Eigen::Affine3d::Identity();
  placement.linear().col(0) = x;
  placement.linear().col(1) = z.cross(x);
  placement.linear().col(2) = z;
  placement.translation() = *origin * metresPerUnit;
  return placement;
}

// ---- bodies -------------------------------------------------------------------------------------

/// Whether a representation promises triangles. Files disagree on identifiers, so drawings are
/// recognised, and all else is a body.
bool isBody(const StepFile& file, std::uint32_t representation, int depth) {
  const StepStatement* statement = file.find(representation);
  if (statement == nullptr || depth == 0) return false;
  const Arguments arguments = stepArguments(statement->arguments);
  const std::string identifier = stepText(at(arguments, 1)).value_or("");
  const std::string type = stepText(at(arguments, 2)).value_or("");
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
  if (type != "MappedRepresentation") return !stepReferences(at(arguments, 3)).empty();
  for (const std::uint32_t item : stepReferences(at(arguments, 3))) {
    const StepStatement* mapped = file.find(item, "IFCMAPPEDITEM");
    const auto source =
        mapped == nullptr ? std::nullopt : stepReference(at(stepArguments(mapped->arguments), 0));
    const StepStatement* map = source ? file.find(*source, "IFCREPRESENTATIONMAP") : nullptr;
    const auto inner =
        map == nullptr ? std::nullopt : stepReference(at(stepArguments(map->arguments), 1));
    if (inner && isBody(file, *inner, depth - 1)) return true;
  }
  return false;
}

bool hasBody(const StepFile& file, std::string_view representation) {
  const auto id = stepReference(representation);
  const StepStatement* shape = id ? file.find(*id) : nullptr;
  if (shape == nullptr) return false;
  const std::vector<std::uint32_t> all = stepReferences(at(stepArguments(shape->arguments), 2));
  return std::any_of(all.begin(), all.end(),
                     [&](std::uint32_t one) { return isBody(file, one, kDeepestMapping); });
}

// ---- products -----------------------------------------------------------------------------------

IfcProduct::Role roleOf(std::string_view type) {
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
  if (type.starts_with("IFCSTRUCTURAL")) return Role::drawing;  // models for calculation
  const auto air = kAir.find(type);
  return air == kAir.end() ? Role::thing : air->second;
}

bool isGlobalId(std::string_view text) {
  return text.size() == 24 && text.front() == '\'' && text.back() == '\'';
}

/// (GlobalId, owner, name, description, object type, placement, representation, ...): the schema
/// is not asked, so that classes of later versions are products too.
bool isProduct(const StepFile& file, const Arguments& arguments) {
  if (arguments.size() < 7 || !isGlobalId(arguments[0])) return false;
  const auto referred = [&](std::size_t index) -> std::string_view {
    const auto id = stepReference(arguments[index]);
    const StepStatement* statement = id ? file.find(*id) : nullptr;
    return statement == nullptr ? std::string_view() : statement->type;
  };
  const std::string_view placement = referred(5), shape = referred(6);
  const bool placed = placement.ends_with("PLACEMENT");
  const bool shaped = shape == "IFCPRODUCTDEFINITIONSHAPE" || shape == "IFCPRODUCTREPRESENTATION";
  return (placed || arguments[5] == "$") && (shaped || arguments[6] == "$") && (placed || shaped);
}

void readSizes(const Arguments& arguments, double metresPerUnit, IfcProduct& product) {
  product.overallHeight = stepNumber(at(arguments, 8)).value_or(0) * metresPerUnit;
  product.overallWidth = stepNumber(at(arguments, 9)).value_or(0) * metresPerUnit;
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

/// What the product itself says of how it moves; its type may say it instead.
std::string ownOperation(std::string_view type, const Arguments& arguments) {
  std::size_t index = 0;
  if (isDoor(type) || isWindow(type)) index = 11;  // IFC4
  if (type == "IFCTRANSPORTELEMENT" || type == "IFCTRANSPORTATIONDEVICE") index = 8;
  return index == 0 ? std::string() : std::string(stepSymbol(at(arguments, index)));
}

std::string operationOfType(const StepStatement& type) {
  static const std::map<std::string_view, std::size_t> kWhere{
      {"IFCDOORSTYLE", 8},   {"IFCDOORTYPE", 10},   {"IFCTRANSPORTELEMENTTYPE", 9},
      {"IFCWINDOWSTYLE", 9}, {"IFCWINDOWTYPE", 10}, {"IFCTRANSPORTATIONDEVICETYPE", 9}};
  const auto where = kWhere.find(type.type);
  if (where == kWhere.end()) return {};
  return std::string(stepSymbol(at(stepArguments(type.arguments), where->second)));
}

class FactReader {
 public:
  explicit FactReader(const StepFile& file) : file_(file) {}

  IfcFacts read() {
    readUnit();
    for (const StepStatement& statement : file_.statements()) readStatement(statement);
    for (const StepStatement& statement : file_.statements()) readRelation(statement);
    for (IfcProduct& product : facts_.products) {
      const auto host = hostOfOpening_.find(product.opening);
      if (host != hostOfOpening_.end()) product.host = host->second;
    }
    return std::move(facts_);
  }

 private:
  void readUnit() {
    facts_.schema = file_.schema();
    facts_.whole = file_.hasEnd();
    if (const auto metres = ifcMetresPerUnit(file_, facts_.siUnit)) {
      facts_.metresPerUnit = *metres;
    } else {
      facts_.unitGuessed = "no length unit in IFCUNITASSIGNMENT: taken for metres";
    }
    facts_.mapPlace = ifcMapPlace(file_, facts_.metresPerUnit);
  }

  void readStatement(const StepStatement& statement) {
    const std::size_t quote = statement.arguments.find_first_not_of(" \t\r\n");
    if (quote == std::string_view::npos || statement.arguments[quote] != '\'') return;
    const Arguments arguments = stepArguments(statement.arguments);
    if (statement.type == "IFCPROJECT") {
      facts_.projects[statement.id] = stepText(at(arguments, 2)).value_or("");
      return;
    }
    if (!isProduct(file_, arguments)) return;
    IfcProduct product;
    product.id = statement.id;
    product.role = roleOf(statement.type);
    product.hasBody = hasBody(file_, arguments[6]);
    product.globalId = stepText(arguments[0]).value_or("");
    product.ifcClass = ifcClassName(statement.type);
    product.name = stepText(arguments[2]).value_or("");
    product.operation = ownOperation(statement.type, arguments);
    if (isDoor(statement.type) || isWindow(statement.type)) {
      readSizes(arguments, facts_.metresPerUnit, product);
    }
    if (const auto placement = stepReference(arguments[5])) {
      product.fileFromPlacement = ifcPlacement(file_, *placement, facts_.metresPerUnit);
    }
    if (!facts_.byId.emplace(product.id, facts_.products.size()).second) return;
    facts_.products.push_back(std::move(product));
  }

  /// All relations: (GlobalId, owner, name, description, one side, other side).
  void readRelation(const StepStatement& statement) {
    if (!statement.type.starts_with("IFCREL")) return;
    const Arguments arguments = stepArguments(statement.arguments);
    const auto sides = [&](std::size_t one, std::size_t many, auto take) {
      const auto id = stepReference(at(arguments, one));
      if (!id) return;
      for (const std::uint32_t other : stepReferences(at(arguments, many))) take(*id, other);
    };
    const auto setParent = [&](std::uint32_t parent, std::uint32_t child) {
      if (const auto product = facts_.byId.find(child); product != facts_.byId.end()) {
        std::uint32_t& known = facts_.products[product->second].parent;
        if (known == 0) known = parent;
      }
    };
    if (statement.type == "IFCRELAGGREGATES" || statement.type == "IFCRELNESTS") {
      sides(4, 5, setParent);
    } else if (statement.type == "IFCRELCONTAINEDINSPATIALSTRUCTURE") {
      sides(5, 4, setParent);
    } else if (statement.type == "IFCRELVOIDSELEMENT") {
      sides(4, 5, [&](std::uint32_t host, std::uint32_t opening) {
        hostOfOpening_.emplace(opening, host);
      });
    } else if (statement.type == "IFCRELFILLSELEMENT") {
      sides(4, 5, [&](std::uint32_t opening, std::uint32_t filling) {
        const auto product = facts_.byId.find(filling);
        if (product != facts_.byId.end()) facts_.products[product->second].opening = opening;
      });
    } else if (statement.type == "IFCRELDEFINESBYTYPE") {
      sides(5, 4, [&](std::uint32_t type, std::uint32_t id) { takeOperation(type, id); });
    }
  }

  void takeOperation(std::uint32_t type, std::uint32_t id) {
    const StepStatement* statement = file_.find(type);
    const auto product = facts_.byId.find(id);
    if (statement == nullptr || product == facts_.byId.end()) return;
    std::string& operation = facts_.products[product->second].operation;
    const bool open = operation.empty() || operation == "NOTDEFINED";
    const std::string told = operationOfType(*statement);
    if (open && !told.empty()) operation = told;
  }

  const StepFile& file_;
  IfcFacts facts_;
  std::map<std::uint32_t, std::uint32_t> hostOfOpening_;
};

}  // namespace

const IfcProduct* IfcFacts::find(std::uint32_t id) const {
  const auto found = byId.find(id);
  return found == byId.end() ? nullptr : &products[found->second];
}

std::optional<Eigen::Affine3d> ifcPlacement(const StepFile& file, std::uint32_t placement,
                                            double metresPerUnit) {
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  std::optional<std::uint32_t> next = placement;
  for (int depth = 0; next && depth < kDeepestPlacement; ++depth) {
    const StepStatement* statement = file.find(*next, "IFCLOCALPLACEMENT");
    if (statement == nullptr) return std::nullopt;
    const Arguments arguments = stepArguments(statement->arguments);
    const auto relative = stepReference(at(arguments, 1));
    const auto local = relative ? axisPlacement(file, *relative, metresPerUnit) : std::nullopt;
    if (!local) return std::nullopt;
    result = *local * result;
    next = stepReference(at(arguments, 0));
  }
  if (next || !result.matrix().allFinite()) return std::nullopt;
  return result;
}

IfcFacts readIfcFacts(const StepFile& file) {
  return FactReader(file).read();
}

}  // namespace enfilade::scene
