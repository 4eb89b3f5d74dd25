#include "scene/import/ifc/import_ifc.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <set>
#include <thread>

#include "scene/import/assembly/coordinates.hpp"
#include "scene/import/assembly/finish_model.hpp"
#include "scene/import/file/ifc_file.hpp"
#include "scene/import/file/ifc_parts.hpp"
#include "scene/import/ifc/elevators.hpp"
#include "scene/import/ifc/ifc_readers.hpp"
#include "scene/import/ifc/ifc_xml.hpp"
#include "scene/import/ifc/openings.hpp"
#include "scene/import/ifc/spatial_structure.hpp"
#include "scene/model/add_diagnostic.hpp"
#include "scene/model/srgb.hpp"

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kImportTimeFraction =
    0.95;  // of the time limit; the rest is for sending the result
constexpr double kReaderTimeFraction = 0.6;  // of the remaining time, if another reader may follow
constexpr std::size_t kReaderProcesses = 2;  // of web-ifc for one large file
/// Bytes of text from which a second process, which starts in 0.1 s, pays.
constexpr std::size_t kMinDividedText = std::size_t{16} << 20;

std::string describeProduct(const IfcProduct& product) {
  std::string text = product.globalId + " (" + product.ifcClass;
  if (!product.name.empty()) text += " '" + product.name + "'";
  return text + ")";
}

/// Converts the readers' meshes to imported nodes and meshes, with one material per colour.
class NodeBuilder {
 public:
  /// `worldFromFile`: from the file's axes, in metres of the file's unit.
  NodeBuilder(const IfcMetadata& metadata, const Eigen::Affine3d& worldFromFile, Model& model)
      : metadata_(metadata),
        paths_(buildIfcPaths(metadata)),
        storeys_(metadata),
        worldFromFile_(worldFromFile),
        worldFromReader_(worldFromFile * Eigen::Affine3d(makeYUpRotation(UpAxis::z).transpose())),
        model_(model) {}

  /// Moves geometries of these meshes out of them, instead of copying: those of one colour that no
  /// space needs.
  void moveGeometries(const IfcMeshes& meshes) {
    std::map<std::uint32_t, const IfcPlacedGeometry*> first;
    std::set<std::uint32_t> kept;
    for (const auto& [id, parts] : meshes.products) {
      const IfcProduct* product = metadata_.find(id);
      const bool space = product == nullptr || product->role == IfcProduct::Role::space;
      for (const IfcPlacedGeometry& placed : parts) {
        const auto known = first.try_emplace(placed.geometry, &placed).first;
        if (space || known->second->colour != placed.colour) kept.insert(placed.geometry);
      }
    }
    for (const auto& [geometry, placed] : first)
      if (!kept.contains(geometry) && !meshes.geometries.at(geometry).indices.empty())
        movable_.emplace(&meshes, geometry);
  }

  void addProduct(const IfcProduct& product, IfcMeshes& meshes) {
    ImportedNode imported;
    imported.object = makeObject(product);
    for (const IfcPlacedGeometry& placed : meshes.products.at(product.id)) {
      const bool moved = movable_.contains({&meshes, placed.geometry});
      if (!moved && meshes.geometries.at(placed.geometry).indices.empty()) continue;
      imported.instances.push_back(
          {findOrAddMesh(meshes, placed, product), worldFromReader_ * placed.worldFromGeometry});
    }
    if (!imported.instances.empty()) importedNodes.push_back(std::move(imported));
  }

  /// An object with the product's metadata and placement.
  Object makeObject(const IfcProduct& product) const {
    Object object;
    object.path = paths_.at(product.id);
    object.globalId = product.globalId;
    object.ifcClass = product.ifcClass;
    object.operationType = product.operation;
    object.storey = storeys_.find(product);
    const double scale = model_.metresPerUnit / metadata_.metresPerUnit;
    object.overallWidth = product.overallWidth * scale;
    object.overallHeight = product.overallHeight * scale;
    if (product.fileFromPlacement) {
      Eigen::Affine3d placement = worldFromFile_ * *product.fileFromPlacement;
      for (int axis = 0; axis < 3; ++axis)
        placement.linear().col(axis).normalize();  // a placement has no scale
      object.worldFromPlacement = std::make_shared<Eigen::Affine3d>(placement);
    }
    return object;
  }

  /// Adds storeys and spaces; call it when the model has its objects and offset.
  void addStructure(const IfcMeshes& meshes) {
    addSpatialStructure(metadata_, storeys_, meshes, worldFromFile_, worldFromReader_, model_);
  }

  std::vector<ImportedNode> importedNodes;
  std::vector<Mesh> convertedMeshes;

 private:
  std::uint32_t findOrAddMesh(IfcMeshes& meshes, const IfcPlacedGeometry& placed,
                              const IfcProduct& product) {
    const std::uint32_t material = findOrAddMaterial(placed.colour);
    const auto [known, isNew] = meshByGeometry_.try_emplace(
        {&meshes, placed.geometry, material}, static_cast<std::uint32_t>(convertedMeshes.size()));
    if (!isNew) return known->second;
    IfcGeometry& source = meshes.geometries.at(placed.geometry);
    IfcGeometry geometry =
        movable_.contains({&meshes, placed.geometry}) ? std::move(source) : source;
    Mesh mesh;
    mesh.name = product.name.empty() ? product.ifcClass : product.name;
    mesh.positions = std::move(geometry.positions);
    mesh.normals = std::move(geometry.normals);
    mesh.indices = std::move(geometry.indices);
    mesh.material = material;
    convertedMeshes.push_back(std::move(mesh));
    return known->second;
  }

  std::uint32_t findOrAddMaterial(const Eigen::Vector4f& colour) {
    const std::array<float, 4> key{colour[0], colour[1], colour[2], colour[3]};
    const auto [known, isNew] =
        materialByColour_.try_emplace(key, static_cast<std::uint32_t>(model_.materials.size()));
    if (!isNew) return known->second;
    Material material;
    material.name = "colour " + std::to_string(known->second + 1);
    for (int i = 0; i < 3; ++i) material.baseColour[i] = srgbToLinear(colour[i]);
    material.baseColour[3] = colour[3];
    if (colour[3] < 1) material.alpha = Material::Alpha::blend;
    material.doubleSided = true;
    model_.materials.push_back(std::move(material));
    return known->second;
  }

  const IfcMetadata& metadata_;
  std::map<std::uint32_t, std::string> paths_;
  const StoreyTable storeys_;
  const Eigen::Affine3d worldFromFile_;
  const Eigen::Affine3d worldFromReader_;  ///< readers deliver metres, Y up
  Model& model_;
  std::map<std::array<float, 4>, std::uint32_t> materialByColour_;
  std::map<std::tuple<const IfcMeshes*, std::uint32_t, std::uint32_t>, std::uint32_t>
      meshByGeometry_;
  std::set<std::pair<const IfcMeshes*, std::uint32_t>> movable_;
};

/// Whether a geometry of the product has floats coarser than kMaxFloatSpacing.
bool isLowPrecision(const IfcMeshes& meshes, std::uint32_t product) {
  const auto found = meshes.products.find(product);
  if (found == meshes.products.end()) return false;
  return std::any_of(
      found->second.begin(), found->second.end(), [&](const IfcPlacedGeometry& placed) {
        float maxCoordinate = 0;
        for (const Eigen::Vector3f& p : meshes.geometries.at(placed.geometry).positions) {
          maxCoordinate = std::max(maxCoordinate, p.cwiseAbs().maxCoeff());
        }
        const double scale = placed.worldFromGeometry.linear().cwiseAbs().maxCoeff();
        return static_cast<double>(maxCoordinate) * scale * 0x1p-23 > kMaxFloatSpacing;
      });
}

class IfcImport {
 public:
  IfcImport(const ImportRequest& request, const ImportProgress& progress)
      : request_(request), progress_(progress), startTime_(Clock::now()) {}

  Model run() {
    reportProgress("open", 0);
    const std::size_t maxBytes = computeMaxTextBytes(request_.options);
    std::string text = readIfcFile(request_.file, maxBytes);
    if (isXml(text))
      text = convertIfcXml(request_, text, {maxBytes, computeRemainingTime()}, progress_,
                           diagnostics_);
    if (text.find("ISO-10303-21") == std::string::npos) {
      throw ImportError(request_.file + ": not an IFC file (it does not begin with " +
                        "ISO-10303-21); export it again as IFC");
    }
    reportProgress("index", 0);
    startWebIfc(text);
    readText(std::move(text));
    Model model = readMeshes();
    model.source = request_.file;
    reportProgress("openings", 0);
    reportOpenings(checkOpenings(model, metadata_), diagnostics_);
    findElevators(model, metadata_, diagnostics_);
    model.diagnostics.insert(model.diagnostics.end(), diagnostics_.begin(), diagnostics_.end());
    return model;
  }

 private:
  /// Starts as many processes of web-ifc as the text may need. They wait for the input.
  void startWebIfc(const std::string& text) {
    const bool divided =
        text.size() >= kMinDividedText && std::thread::hardware_concurrency() >= kReaderProcesses;
    input_.emplace(request_, divided ? kReaderProcesses : 1);
    if (isReaderAllowed(IfcReader::webIfc))
      webIfc_.emplace(*input_, computeReaderTimeLimit(), progress_);
  }

  /// Reads the metadata and passes the text on to the readers; it is not kept.
  void readText(std::string text) {
    const StepFile file(std::move(text));
    metadata_ = readIfcMetadata(file);
    reportMetadata(file);
    wanted_ = collectWantedProducts();
    std::vector<std::uint32_t> read = wanted_;
    for (const IfcProduct& product : metadata_.products)
      if (product.hasBody && product.role == IfcProduct::Role::space) read.push_back(product.id);
    std::vector<IfcFilePart> parts = divideForProcesses(file, read);
    input_->fill(file.text(), std::move(read), std::move(parts));
  }

  /// The parts that processes of web-ifc read at the same time; empty: one process reads all. A
  /// damaged file is read whole, because its readers may find other statements than the index.
  std::vector<IfcFilePart> divideForProcesses(const StepFile& file,
                                              const std::vector<std::uint32_t>& products) const {
    const std::size_t count = webIfc_ ? input_->partCount() : 1;
    const bool isWhole = metadata_.complete && file.damagedCount() == 0;
    return count > 1 && isWhole ? divideIfc(file, products, count) : std::vector<IfcFilePart>();
  }

  void reportProgress(const char* stage, double fraction) const {
    if (progress_) progress_(stage, fraction);
  }

  double computeRemainingTime() const {
    return request_.options.timeLimit * kImportTimeFraction -
           std::chrono::duration<double>(Clock::now() - startTime_).count();
  }

  void reportMetadata(const StepFile& file) {
    if (!metadata_.complete) {
      addDiagnostic(diagnostics_, "cut_off_file",
                    "END-ISO-10303-21 is missing at the end: products may be missing, too; copy or "
                    "export it again");
    }
    addDiagnostic(diagnostics_, "damaged_statement", "skipped by the index", file.damagedCount());
    if (metadata_.unitAssumption && !request_.options.metresPerUnit) {
      addDiagnostic(diagnostics_, "no_unit", *metadata_.unitAssumption);
    }
    for (const Diagnostic& problem : metadata_.diagnostics)
      addDiagnostic(diagnostics_, problem.kind, problem.example, problem.count);
    if (request_.options.georeference)
      metadata_.trueNorth =
          computeGridNorth(requireMap(metadata_.mapConversion, metadata_.mapFault));
    if (!metadata_.mapFault.empty()) addDiagnostic(diagnostics_, "broken_map", metadata_.mapFault);
    if (metadata_.mapConversion)
      addDiagnostic(diagnostics_, "map_place", formatMapConversion(*metadata_.mapConversion));
    for (const IfcProduct& product : metadata_.products) {
      if (!product.hasBody) continue;
      if (product.role == IfcProduct::Role::space)
        addDiagnostic(diagnostics_, "skipped_spaces", describeProduct(product));
      if (product.role == IfcProduct::Role::opening) {
        addDiagnostic(diagnostics_, "skipped_openings", describeProduct(product));
      }
    }
  }

  std::vector<std::uint32_t> collectWantedProducts() const {
    std::vector<std::uint32_t> wanted;
    for (const IfcProduct& product : metadata_.products) {
      if (isWanted(product)) wanted.push_back(product.id);
    }
    if (wanted.empty()) {
      throw ImportError(
          request_.file + ": contains no products with a shape" +
          (metadata_.complete ? "" : ", and is cut off (END-ISO-10303-21 is missing)") +
          "; export it again with its geometry");
    }
    return wanted;
  }
  static bool isWanted(const IfcProduct& product) {
    return product.hasBody && product.role == IfcProduct::Role::physical;
  }

  bool isReaderAllowed(IfcReader reader) const {
    return request_.options.ifcReader == IfcReader::automatic ||
           request_.options.ifcReader == reader;
  }

  /// Time limit of the next reader, seconds: the remaining time, or a part of it if another reader
  /// may follow.
  double computeReaderTimeLimit() const {
    return request_.options.ifcReader == IfcReader::automatic
               ? computeRemainingTime() * kReaderTimeFraction
               : computeRemainingTime();
  }

  Model readMeshes() {
    if (webIfc_) {
      IfcReadResult web = webIfc_->finish();
      recordFailure("web-ifc", web);
      if (hasTriangles(web.meshes)) return makeModel(web.meshes, "web-ifc");
    }
    if (isReaderAllowed(IfcReader::ifcPlusPlus)) {
      IfcReadResult plus = readWithIfcPlusPlus(*input_, computeReaderTimeLimit(), progress_);
      recordFailure("ifcplusplus", plus);
      if (hasTriangles(plus.meshes)) return makeModel(plus.meshes, "ifcplusplus");
    }
    if (isReaderAllowed(IfcReader::assimp)) {
      AssimpReadResult assimp = readIfcWithAssimp(*input_, computeRemainingTime(), progress_);
      if (assimp.model) return addMetadata(std::move(*assimp.model));
      failures_ += (failures_.empty() ? "" : "; ") + ("assimp: " + assimp.failure);
    }
    const bool all = request_.options.ifcReader == IfcReader::automatic;
    throw ImportError(
        request_.file + ": cannot be read: " + failures_ + "; " +
        (metadata_.complete ? "" : "it is cut off (END-ISO-10303-21 is missing): copy it again; ") +
        (all ? "" : "try --ifc-reader auto, ") +
        "check it with an IFC validator, or re-export it as IFC2x3 or glTF");
  }

  void recordFailure(const std::string& reader, const IfcReadResult& result) {
    std::string reason = result.failure;
    if (reason.empty() && !hasTriangles(result.meshes)) reason = "delivers no triangles";
    if (reason.empty()) return;
    failures_ += (failures_.empty() ? "" : "; ") + reader + ": " + reason;
    addDiagnostic(diagnostics_, result.notInstalled ? "ifc_reader_absent" : "ifc_reader_failed",
                  reader + ": " + reason);
  }

  bool hasTriangles(const IfcMeshes& meshes) const {
    return std::any_of(wanted_.begin(), wanted_.end(),
                       [&](std::uint32_t id) { return meshes.countTriangles(id) > 0; });
  }

  Model makeEmptyModel(const std::string& reader) const {
    Model model;
    model.reader = reader;
    model.metresPerUnit = request_.options.metresPerUnit.value_or(metadata_.metresPerUnit);
    model.upAxis = request_.options.up.value_or(UpAxis::z);
    if (request_.options.georeference) model.map = metadata_.mapConversion->crs;
    return model;
  }

  /// From the file's axes, in metres, to the world; with the map conversion on request.
  Eigen::Affine3d computeWorldFromFile(const Model& model) const {
    Eigen::Affine3d transform = Eigen::Affine3d::Identity();
    if (request_.options.georeference) transform = computeMapFromFile(*metadata_.mapConversion);
    return Eigen::Affine3d(makeYUpRotation(model.upAxis)) * transform *
           Eigen::Scaling(model.metresPerUnit / metadata_.metresPerUnit);
  }

  /// The reader whose meshes a product gets.
  enum class Source : std::uint8_t { none, first, second };

  Model makeModel(IfcMeshes& meshes, const std::string& reader) {
    std::optional<IfcReadResult> second = readMissingProducts(meshes, reader);
    reportProgress("convert", 0);
    std::map<std::uint32_t, Source> sources;
    bool anySecond = false;
    for (const std::uint32_t id : wanted_) {
      const bool other =
          second && second->meshes.countTriangles(id) > 0 && needsSecondReader(meshes, id);
      const bool own = meshes.countTriangles(id) > 0;
      anySecond = anySecond || other;
      sources[id] = other ? Source::second : own ? Source::first : Source::none;
    }
    // Walls of the second reader alone may be dropped, which takes another build.
    Model model = buildModel(meshes, second, sources, reader, !anySecond);
    if (anySecond && dropFullyCutHosts(model, meshes, sources))
      model = buildModel(meshes, second, sources, reader, true);
    reportSources(meshes, sources);
    return model;
  }

  /// `isLast`: the geometries may be moved into the model.
  Model buildModel(IfcMeshes& first, std::optional<IfcReadResult>& second,
                   const std::map<std::uint32_t, Source>& sources, const std::string& reader,
                   bool isLast) const {
    Model model = makeEmptyModel(reader);
    NodeBuilder builder(metadata_, computeWorldFromFile(model), model);
    if (isLast) builder.moveGeometries(first);
    if (isLast && second) builder.moveGeometries(second->meshes);
    for (const auto& product : metadata_.products) {
      const auto source = sources.find(product.id);
      if (source == sources.end() || source->second == Source::none) continue;
      builder.addProduct(product, source->second == Source::first ? first : second->meshes);
    }
    finishModel(std::move(builder.importedNodes), std::move(builder.convertedMeshes), request_.file,
                request_.options.offset, model);
    builder.addStructure(first);
    return model;
  }

  /// Decides about walls that web-ifc delivers empty and ifcplusplus delivers with their own doors
  /// closed. A frame's wall is often no larger than its opening: it is dropped. A larger wall stays
  /// solid, so that no avatar walks through it. Returns whether any wall was dropped.
  bool dropFullyCutHosts(const Model& model, const IfcMeshes& first,
                         std::map<std::uint32_t, Source>& sources) {
    bool any = false;
    std::set<std::uint32_t> decided;
    for (const UncutOpening& uncut : checkOpenings(model, metadata_).uncut) {
      const auto source = sources.find(uncut.host);
      if (source == sources.end() || source->second != Source::second) continue;
      if (first.failures.contains(uncut.host)) continue;  // unreadable, not empty
      if (!decided.insert(uncut.host).second) continue;
      const IfcProduct& host = *metadata_.find(uncut.host);
      if (isLargerThanOpenings(model, metadata_, host)) {
        addDiagnostic(diagnostics_, "solid_product",
                      describeProduct(host) + ": its openings could not be cut");
        continue;
      }
      source->second = Source::none;
      addDiagnostic(diagnostics_, "cut_away_product",
                    describeProduct(host) + ": its openings remove all of it");
      fullyCutHosts_.insert(uncut.host);
      any = true;
    }
    return any;
  }

  void reportSources(const IfcMeshes& first, const std::map<std::uint32_t, Source>& sources) {
    for (const auto& [id, source] : sources) {
      const IfcProduct& product = *metadata_.find(id);
      if (source == Source::second) {
        addDiagnostic(diagnostics_, "openings_unverified",
                      describeProduct(product) + ": shape by ifcplusplus; openings may be closed");
      } else if (source == Source::none && !fullyCutHosts_.contains(id)) {
        addDiagnostic(diagnostics_, "missing_product",
                      describeProduct(product) + describeMissing(first, id));
      }
    }
  }

  static bool needsSecondReader(const IfcMeshes& meshes, std::uint32_t product) {
    return meshes.countTriangles(product) == 0 || isLowPrecision(meshes, product);
  }

  static std::string describeMissing(const IfcMeshes& meshes, std::uint32_t product) {
    const auto failure = meshes.failures.find(product);
    if (failure == meshes.failures.end()) return ": has a body, but the reader gave no triangles";
    return ": " + failure->second;
  }

  /// Reads the file with ifcplusplus if web-ifc delivered no or imprecise meshes for some product.
  std::optional<IfcReadResult> readMissingProducts(const IfcMeshes& meshes,
                                                   const std::string& reader) {
    const bool whole = std::none_of(wanted_.begin(), wanted_.end(), [&](std::uint32_t id) {
      return needsSecondReader(meshes, id);
    });
    if (whole || reader != "web-ifc" || request_.options.ifcReader != IfcReader::automatic) {
      return std::nullopt;
    }
    IfcReadResult second = readWithIfcPlusPlus(*input_, computeReaderTimeLimit(), progress_);
    recordFailure("ifcplusplus", second);
    return second;
  }

  /// Adds the text's product metadata to assimp's model.
  Model addMetadata(Model model) const {
    std::map<std::string, const IfcProduct*> byGlobalId;
    for (const IfcProduct& product : metadata_.products) {
      byGlobalId.emplace(product.globalId, &product);
    }
    NodeBuilder builder(metadata_, computeWorldFromFile(model), model);
    builder.addStructure({});
    std::set<std::string> taken;
    for (Object& object : model.objects) {
      const auto product = byGlobalId.find(object.globalId);
      if (product == byGlobalId.end() || !taken.insert(object.globalId).second) continue;
      Object described = builder.makeObject(*product->second);
      described.meshes = std::move(object.meshes);
      described.worldFromMesh = object.worldFromMesh;
      movePlacement(described, -model.offset);
      object = std::move(described);
    }
    return model;
  }

  const ImportRequest& request_;
  const ImportProgress& progress_;
  Clock::time_point startTime_;
  IfcMetadata metadata_;
  std::vector<std::uint32_t> wanted_;  ///< products of the model; readers also read spaces
  std::optional<IfcInput> input_;
  std::optional<WebIfcReading> webIfc_;
  std::vector<Diagnostic> diagnostics_;
  std::set<std::uint32_t> fullyCutHosts_;
  std::string failures_;
};

}  // namespace

Model importIfc(const ImportRequest& request, const ImportProgress& progress) {
  return IfcImport(request, progress).run();
}

}  // namespace enfilade::scene
