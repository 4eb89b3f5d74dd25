#include "scene/import/ifc/import_ifc.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <set>

#include "scene/import/ifc/ifc_file.hpp"
#include "scene/import/ifc/ifc_readers.hpp"

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kDeepestPath = 100;      // levels from the project to a product
constexpr double kOwnShare = 0.95;     // of the time limit: the rest is for the answer
constexpr double kReaderShare = 0.6;   // of what is left, for a reader that others may follow
constexpr std::size_t kTextShare = 8;  // the file's text may take this part of the memory
constexpr std::size_t kLargestText = std::size_t{4} << 30;  // bytes, where memory has no limit

class Paths {
 public:
  explicit Paths(const IfcFacts& facts) : facts_(facts) {}

  const std::string& pathOf(std::uint32_t id, int depth = 0) {
    const auto known = paths_.find(id);
    if (known != paths_.end()) return known->second;
    const IfcProduct* product = facts_.find(id);
    const std::uint32_t parent = product == nullptr ? 0 : parentOf(*product, depth);
    const std::string above = parent == 0 ? std::string() : pathOf(parent, depth + 1) + "/";
    return paths_[id] = above + siblings_[parent].claim(segmentFor(id, product));
  }
  std::map<std::uint32_t, std::string> take() { return std::move(paths_); }

 private:
  std::uint32_t parentOf(const IfcProduct& product, int depth) const {
    const bool known =
        facts_.find(product.parent) != nullptr || facts_.projects.contains(product.parent);
    return known && product.parent != product.id && depth < kDeepestPath ? product.parent : 0;
  }
  std::string segmentFor(std::uint32_t id, const IfcProduct* product) const {
    const auto project = facts_.projects.find(id);
    const std::string& name = product != nullptr ? product->name : project->second;
    if (!name.empty()) return encodedName(name);
    return product != nullptr ? product->ifcClass : "IfcProject";
  }

  const IfcFacts& facts_;
  std::map<std::uint32_t, std::string> paths_;
  std::map<std::uint32_t, SiblingNames> siblings_;
};

std::string nameOf(const IfcProduct& product) {
  std::string text = product.globalId + " (" + product.ifcClass;
  if (!product.name.empty()) text += " '" + product.name + "'";
  return text + ")";
}

/// Materials by colour, and the meshes and drafts that the shapes become.
class DraftBuilder {
 public:
  DraftBuilder(const IfcFacts& facts, const Eigen::Affine3d& worldFromFile, Model& model)
      : facts_(facts),
        paths_(ifcPaths(facts)),
        worldFromReader_(worldFromFile.linear() * yUpFrom('z').transpose() / facts.metresPerUnit),
        model_(model) {}

  void add(const IfcProduct& product, const IfcShapes& shapes) {
    ObjectDraft draft;
    draft.object = objectFor(product);
    for (const IfcPart& part : shapes.products.at(product.id)) {
      const IfcGeometry& geometry = shapes.geometries.at(part.geometry);
      if (geometry.indices.empty()) continue;
      draft.placements.push_back(
          {meshFor(shapes, part, product), worldFromReader_ * part.worldFromGeometry});
    }
    if (!draft.placements.empty()) drafts.push_back(std::move(draft));
  }

  /// What the file says of a product, placed where the file places it.
  Object objectFor(const IfcProduct& product) const {
    Object object;
    object.path = paths_.at(product.id);
    object.globalId = product.globalId;
    object.ifcClass = product.ifcClass;
    object.operation = product.operation;
    const double scale = model_.metresPerUnit / facts_.metresPerUnit;
    object.overallWidth = product.overallWidth * scale;
    object.overallHeight = product.overallHeight * scale;
    if (product.fileFromPlacement) {
      const Eigen::Matrix3d turn = yUpFrom(model_.up);
      object.worldFromPlacement.emplace(Eigen::Affine3d::Identity());
      object.worldFromPlacement->linear() = turn * product.fileFromPlacement->linear();
      object.worldFromPlacement->translation() =
          turn * product.fileFromPlacement->translation() * scale;
    }
    return object;
  }

  std::vector<ObjectDraft> drafts;
  std::vector<Mesh> meshes;

 private:
  std::uint32_t meshFor(const IfcShapes& shapes, const IfcPart& part, const IfcProduct& product) {
    const std::uint32_t material = materialFor(part.colour);
    const auto [known, isNew] = meshOf_.try_emplace({&shapes, part.geometry, material},
                                                    static_cast<std::uint32_t>(meshes.size()));
    if (!isNew) return known->second;
    const IfcGeometry& geometry = shapes.geometries.at(part.geometry);
    Mesh mesh;
    mesh.name = product.name.empty() ? product.ifcClass : product.name;
    mesh.positions = geometry.positions;
    mesh.normals = geometry.normals;
    mesh.indices = geometry.indices;
    mesh.material = material;
    meshes.push_back(std::move(mesh));
    return known->second;
  }

  std::uint32_t materialFor(const Eigen::Vector4f& colour) {
    const std::array<float, 4> key{colour[0], colour[1], colour[2], colour[3]};
    const auto [known, isNew] =
        materialOf_.try_emplace(key, static_cast<std::uint32_t>(model_.materials.size()));
    if (!isNew) return known->second;
    Material material;
    material.name = "colour " + std::to_string(known->second + 1);
    for (int i = 0; i < 3; ++i) material.baseColour[i] = linearFromSrgb(colour[i]);
    material.baseColour[3] = colour[3];
    if (colour[3] < 1) material.alpha = Material::Alpha::blend;
    material.doubleSided = true;
    model_.materials.push_back(std::move(material));
    return known->second;
  }

  const IfcFacts& facts_;
  std::map<std::uint32_t, std::string> paths_;
  Eigen::Affine3d worldFromReader_;  ///< of what readers deliver in metres, Y up
  Model& model_;
  std::map<std::array<float, 4>, std::uint32_t> materialOf_;
  std::map<std::tuple<const IfcShapes*, std::uint32_t, std::uint32_t>, std::uint32_t> meshOf_;
};

/// True when a part's floats are too coarse for where they lie.
bool isCoarse(const IfcShapes& shapes, std::uint32_t product) {
  const auto found = shapes.products.find(product);
  if (found == shapes.products.end()) return false;
  return std::any_of(found->second.begin(), found->second.end(), [&](const IfcPart& part) {
    float greatest = 0;
    for (const Eigen::Vector3f& p : shapes.geometries.at(part.geometry).positions) {
      greatest = std::max(greatest, p.cwiseAbs().maxCoeff());
    }
    const double scale = part.worldFromGeometry.linear().cwiseAbs().maxCoeff();
    return static_cast<double>(greatest) * scale * 0x1p-23 > kCoarse;
  });
}

std::string textOf(const IfcMapPlace& place) {
  constexpr double kDegrees = 57.29577951308232;
  char text[160];
  std::snprintf(text, sizeof text,
                "the file's origin is at E %.3f, N %.3f, H %.3f m, its x axis %.6f degrees from "
                "east to north, scale %.9g",
                place.east, place.north, place.height, place.turn * kDegrees, place.scale);
  return (place.crs.empty() ? "a map without a name" : place.crs) + ": " + text;
}

class IfcImport {
 public:
  IfcImport(const ImportRequest& request, const ImportProgress& progress)
      : request_(request), progress_(progress), start_(Clock::now()) {}

  Model run() {
    tell("open", 0);
    const std::size_t largest =
        request_.memoryLimit > 0 ? request_.memoryLimit / kTextShare : kLargestText;
    std::string text = readIfcFile(request_.file, largest);
    if (text.find("ISO-10303-21") == std::string::npos) {
      throw ImportError(request_.file + ": not an IFC file (it does not begin with " +
                        "ISO-10303-21); export it again as IFC (open)");
    }
    tell("index", 0);
    const StepFile file(std::move(text));
    facts_ = readIfcFacts(file);
    reportFacts(file);
    input_.emplace(request_, file.text(), wantedProducts());
    Model model = readShapes();
    model.source = request_.file;
    tell("openings", 0);
    reportOpenings(checkOpenings(model, facts_), problems_);
    findLifts(model, facts_, problems_);
    for (const Problem& problem : problems_.problems()) model.problems.push_back(problem);
    return model;
  }

 private:
  void tell(const char* stage, double fraction) const {
    if (progress_) progress_(stage, fraction);
  }

  double timeLeft() const {
    return request_.timeLimit * kOwnShare -
           std::chrono::duration<double>(Clock::now() - start_).count();
  }

  void reportFacts(const StepFile& file) {
    if (!facts_.whole) {
      problems_.add("cut_off_file",
                    "END-ISO-10303-21 is missing at the end: products may be missing too; copy or "
                    "export it again");
    }
    problems_.add("damaged_statement", "left out by the index", file.damaged());
    if (facts_.unitGuessed && !request_.metresPerUnit) {
      problems_.add("no_unit", *facts_.unitGuessed);
    }
    if (facts_.mapPlace) problems_.add("map_place", textOf(*facts_.mapPlace));
    for (const IfcProduct& product : facts_.products) {
      if (!product.hasBody) continue;
      if (product.role == IfcProduct::Role::space) problems_.add("skipped_spaces", nameOf(product));
      if (product.role == IfcProduct::Role::opening) {
        problems_.add("skipped_openings", nameOf(product));
      }
    }
  }

  std::vector<std::uint32_t> wantedProducts() const {
    std::vector<std::uint32_t> wanted;
    for (const IfcProduct& product : facts_.products) {
      if (isWanted(product)) wanted.push_back(product.id);
    }
    if (wanted.empty()) {
      throw ImportError(request_.file + ": holds no products with a shape" +
                        (facts_.whole ? "" : ", and is cut off (END-ISO-10303-21 is missing)") +
                        "; export it again with its geometry (open)");
    }
    return wanted;
  }
  static bool isWanted(const IfcProduct& product) {
    return product.hasBody && product.role == IfcProduct::Role::thing;
  }

  bool mayUse(IfcReader reader) const {
    return request_.ifcReader == IfcReader::automatic || request_.ifcReader == reader;
  }

  /// What another reader may take of the time that is left; all of it, where none may follow.
  double share() const {
    return request_.ifcReader == IfcReader::automatic ? timeLeft() * kReaderShare : timeLeft();
  }

  Model readShapes() {
    if (mayUse(IfcReader::webIfc)) {
      const IfcReading web = readByWebIfc(*input_, share(), progress_);
      noteFailure("web-ifc", web);
      if (hasTriangles(web.shapes)) return modelOf(web.shapes, "web-ifc");
    }
    if (mayUse(IfcReader::ifcPlusPlus)) {
      const IfcReading plus = readByIfcPlusPlus(*input_, share(), progress_);
      noteFailure("ifcplusplus", plus);
      if (hasTriangles(plus.shapes)) return modelOf(plus.shapes, "ifcplusplus");
    }
    if (mayUse(IfcReader::assimp)) {
      AssimpReading assimp = readIfcByAssimp(*input_, timeLeft(), progress_);
      if (assimp.model) return described(std::move(*assimp.model));
      failures_ += (failures_.empty() ? "" : "; ") + ("assimp: " + assimp.failure);
    }
    const bool all = request_.ifcReader == IfcReader::automatic;
    throw ImportError(
        request_.file + ": cannot be read: " + failures_ + "; " +
        (facts_.whole ? "" : "it is cut off (END-ISO-10303-21 is missing): copy it again; ") +
        (all ? "" : "try --ifc-reader auto, ") +
        "check it with an IFC validator, or re-export it as IFC2x3 or glTF (parse)");
  }

  void noteFailure(const std::string& reader, const IfcReading& reading) {
    std::string why = reading.failure;
    if (why.empty() && !hasTriangles(reading.shapes)) why = "delivers no triangles";
    if (why.empty()) return;
    failures_ += (failures_.empty() ? "" : "; ") + reader + ": " + why;
    problems_.add(reading.absent ? "ifc_reader_absent" : "ifc_reader_failed", reader + ": " + why);
  }

  bool hasTriangles(const IfcShapes& shapes) const {
    return std::any_of(input_->wanted().begin(), input_->wanted().end(),
                       [&](std::uint32_t id) { return shapes.triangles(id) > 0; });
  }

  Model emptyModel(const std::string& reader) const {
    Model model;
    model.reader = reader;
    model.metresPerUnit = request_.metresPerUnit.value_or(facts_.metresPerUnit);
    model.up = request_.up.value_or('z');
    return model;
  }

  static Eigen::Affine3d worldFromFile(const Model& model) {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    transform.linear() = yUpFrom(model.up) * model.metresPerUnit;
    return transform;
  }

  /// Whose shape of a product is taken.
  enum class Source : std::uint8_t { none, first, second };

  Model modelOf(const IfcShapes& shapes, const std::string& reader) {
    const std::optional<IfcReading> second = secondReading(shapes, reader);
    tell("convert", 0);
    std::map<std::uint32_t, Source> sources;
    for (const std::uint32_t id : input_->wanted()) {
      const bool other = second && second->shapes.triangles(id) > 0 && needsOther(shapes, id);
      const bool own = shapes.triangles(id) > 0;
      sources[id] = other ? Source::second : own ? Source::first : Source::none;
    }
    Model model = build(shapes, second, sources, reader);
    if (leaveOutBlockers(model, shapes, sources)) model = build(shapes, second, sources, reader);
    reportSources(shapes, sources);
    return model;
  }

  Model build(const IfcShapes& first, const std::optional<IfcReading>& second,
              const std::map<std::uint32_t, Source>& sources, const std::string& reader) const {
    Model model = emptyModel(reader);
    ProblemLog problems;
    DraftBuilder builder(facts_, worldFromFile(model), model);
    for (const auto& product : facts_.products) {
      const auto source = sources.find(product.id);
      if (source == sources.end() || source->second == Source::none) continue;
      builder.add(product, source->second == Source::first ? first : second->shapes);
    }
    finishModel(std::move(builder.drafts), std::move(builder.meshes), request_.file,
                request_.offset, model, problems);
    model.problems = problems.problems();
    return model;
  }

  /// Where web-ifc delivers nothing of a wall, and ifcplusplus one that closes the wall's own
  /// doors, its openings took all of it away (a frame's wall is often no larger than its opening).
  bool leaveOutBlockers(const Model& model, const IfcShapes& first,
                        std::map<std::uint32_t, Source>& sources) {
    bool any = false;
    for (const UncutOpening& uncut : checkOpenings(model, facts_).uncut) {
      const auto source = sources.find(uncut.host);
      if (source == sources.end() || source->second != Source::second) continue;
      if (first.failures.contains(uncut.host)) continue;  // not nothing: it could not be read
      source->second = Source::none;
      problems_.add("cut_away_product", nameOf(*facts_.find(uncut.host)) +
                                            ": nothing of it is left beside its openings");
      cutAway_.insert(uncut.host);
      any = true;
    }
    return any;
  }

  void reportSources(const IfcShapes& first, const std::map<std::uint32_t, Source>& sources) {
    for (const auto& [id, source] : sources) {
      const IfcProduct& product = *facts_.find(id);
      if (source == Source::second) {
        problems_.add("openings_unverified",
                      nameOf(product) + ": its shape is ifcplusplus', whose openings may be uncut");
      } else if (source == Source::none && !cutAway_.contains(id)) {
        problems_.add("missing_product", nameOf(product) + reasonOf(first, id));
      }
    }
  }

  static bool needsOther(const IfcShapes& shapes, std::uint32_t product) {
    return shapes.triangles(product) == 0 || isCoarse(shapes, product);
  }

  static std::string reasonOf(const IfcShapes& shapes, std::uint32_t product) {
    const auto failure = shapes.failures.find(product);
    if (failure == shapes.failures.end()) return ": has a body, but came back without triangles";
    return ": " + failure->second;
  }

  /// ifcplusplus' reading of the file, where web-ifc left something out.
  std::optional<IfcReading> secondReading(const IfcShapes& shapes, const std::string& reader) {
    const auto& wanted = input_->wanted();
    const bool whole = std::none_of(wanted.begin(), wanted.end(),
                                    [&](std::uint32_t id) { return needsOther(shapes, id); });
    if (whole || reader != "web-ifc" || request_.ifcReader != IfcReader::automatic) {
      return std::nullopt;
    }
    IfcReading second = readByIfcPlusPlus(*input_, share(), progress_);
    noteFailure("ifcplusplus", second);
    return second;
  }

  /// assimp's model with what the file's text says of its products.
  Model described(Model model) const {
    std::map<std::string, const IfcProduct*> byGlobalId;
    for (const IfcProduct& product : facts_.products) {
      byGlobalId.emplace(product.globalId, &product);
    }
    const DraftBuilder builder(facts_, worldFromFile(model), model);
    std::set<std::string> taken;
    for (Object& object : model.objects) {
      const auto product = byGlobalId.find(object.globalId);
      if (product == byGlobalId.end() || !taken.insert(object.globalId).second) continue;
      Object told = builder.objectFor(*product->second);
      told.meshes = std::move(object.meshes);
      told.worldFromMesh = object.worldFromMesh;
      if (told.worldFromPlacement) told.worldFromPlacement->pretranslate(-model.offset);
      object = std::move(told);
    }
    return model;
  }

  const ImportRequest& request_;
  const ImportProgress& progress_;
  Clock::time_point start_;
  IfcFacts facts_;
  std::optional<IfcInput> input_;
  ProblemLog problems_;
  std::set<std::uint32_t> cutAway_;
  std::string failures_;
};

}  // namespace

std::map<std::uint32_t, std::string> ifcPaths(const IfcFacts& facts) {
  Paths paths(facts);
  for (const IfcProduct& product : facts.products) paths.pathOf(product.id);
  return paths.take();
}

Model importIfc(const ImportRequest& request, const ImportProgress& progress) {
  return IfcImport(request, progress).run();
}

}  // namespace enfilade::scene
