#include "scene/import/worker/model_stream.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <stop_token>
#include <system_error>
#include <thread>

#include "scene/import/worker/stream_bytes.hpp"

namespace enfilade::scene {
namespace {

constexpr std::uint32_t kNone = 0xffffffff;   // an absent index
constexpr std::uint32_t kMagic = 0x4d464e45;  // "ENFM"

// ---- one pair of functions per type -------------------------------------------------------------

void write(StreamWriter& out, const Material& m) {
  out.put(m.name);
  out.putMatrix(m.baseColour);
  out.putMatrix(m.emissive);
  out.put(m.metallic);
  out.put(m.roughness);
  out.put(static_cast<std::uint8_t>(m.alpha));
  out.put(m.alphaCutoff);
  out.put(static_cast<std::uint8_t>(m.doubleSided));
  out.put(m.baseColourTexture);
}

Material readMaterial(StreamReader& in, std::size_t textures) {
  Material m;
  m.name = in.getText("material name");
  m.baseColour = in.getMatrix<Eigen::Vector4f>("base colour");
  m.emissive = in.getMatrix<Eigen::Vector3f>("emissive");
  m.metallic = in.get<float>("metallic");
  m.roughness = in.get<float>("roughness");
  m.alpha = static_cast<Material::Alpha>(in.getUpTo(2, "alpha mode"));
  m.alphaCutoff = in.get<float>("alpha cutoff");
  m.doubleSided = in.getBool("double sided");
  m.baseColourTexture = in.get<std::int32_t>("base colour texture");
  if (m.baseColourTexture < -1 || m.baseColourTexture >= static_cast<std::int64_t>(textures)) {
    in.fail("base colour texture", "no texture " + std::to_string(m.baseColourTexture));
  }
  return m;
}

void write(StreamWriter& out, const Texture& t) {
  out.put(t.name);
  out.put(t.width);
  out.put(t.height);
  out.putArray(t.rgba);
}

Texture readTexture(StreamReader& in) {
  Texture t;
  t.name = in.getText("texture name");
  t.width = in.get<std::uint32_t>("texture width");
  t.height = in.get<std::uint32_t>("texture height");
  t.rgba = in.getBytes("texture pixels");
  const std::uint64_t pixels = std::uint64_t{t.width} * t.height;
  if (pixels > t.rgba.size() || pixels * 4 != t.rgba.size()) {
    in.fail("texture pixels", "not width * height * 4 bytes");
  }
  return t;
}

void write(StreamWriter& out, const Mesh& m) {
  out.put(m.name);
  out.putArray(m.positions);
  out.putArray(m.normals);
  out.putArray(m.uvs);
  out.putArray(m.colours);
  out.putArray(m.indices);
  out.put(m.material);
}

Mesh readMesh(StreamReader& in, std::size_t materials) {
  Mesh m;
  m.name = in.getText("mesh name");
  m.positions = in.getArray<Eigen::Vector3f>("positions");
  m.normals = in.getArray<Eigen::Vector3f>("normals");
  m.uvs = in.getArray<Eigen::Vector2f>("uvs");
  m.colours = in.getArray<VertexColour>("colours");
  m.indices = in.getArray<std::uint32_t>("indices");
  m.material = in.get<std::uint32_t>("mesh material");
  const std::size_t n = m.positions.size();
  for (const Eigen::Vector3f& p : m.positions) {
    if (!p.allFinite()) in.fail("positions", "not a finite number");
  }
  if (!m.normals.empty() && m.normals.size() != n) in.fail("normals", "not one per position");
  if (!m.uvs.empty() && m.uvs.size() != n) in.fail("uvs", "not one per position");
  if (!m.colours.empty() && m.colours.size() != n) in.fail("colours", "not one per position");
  if (m.indices.size() % 3 != 0) in.fail("indices", "not three per triangle");
  for (const std::uint32_t i : m.indices) {
    if (i >= n) in.fail("indices", "no vertex " + std::to_string(i));
  }
  if (m.material >= materials) in.fail("mesh material", "no such material");
  return m;
}

void write(StreamWriter& out, const Storey& storey) {
  out.put(storey.name);
  out.put(storey.globalId);
  out.put(storey.elevation);
}

Storey readStorey(StreamReader& in) {
  Storey storey;
  storey.name = in.getText("storey name");
  storey.globalId = in.getText("storey GlobalId");
  storey.elevation = in.getFinite("storey elevation");
  return storey;
}

std::optional<std::uint32_t> readStoreyIndex(StreamReader& in, std::size_t storeys) {
  const auto index = in.get<std::uint32_t>("storey");
  if (index == kNone) return std::nullopt;
  if (index >= storeys) in.fail("storey", "no storey " + std::to_string(index));
  return index;
}

void write(StreamWriter& out, const Space& space) {
  out.put(space.name);
  out.put(space.longName);
  out.put(space.globalId);
  out.put(space.storey.value_or(kNone));
  out.put(static_cast<std::uint8_t>(space.box.empty()));
  if (space.box.empty()) return;
  out.putMatrix(space.box.min);
  out.putMatrix(space.box.max);
  out.putArray(space.surface);
}

Space readSpace(StreamReader& in, std::size_t storeys) {
  Space space;
  space.name = in.getText("space name");
  space.longName = in.getText("space long name");
  space.globalId = in.getText("space GlobalId");
  space.storey = readStoreyIndex(in, storeys);
  if (in.getBool("space is empty")) return space;
  space.box.min = in.getMatrix<Vec3>("space minimum");
  space.box.max = in.getMatrix<Vec3>("space maximum");
  if (space.box.empty()) in.fail("space maximum", "below the minimum");
  space.surface = in.getArray<Vec3>("space surface");
  if (space.surface.size() % 3 != 0) in.fail("space surface", "not three per triangle");
  for (const Vec3& corner : space.surface)
    if (!contains(space.box, {corner, corner}))
      in.fail("space surface", "a corner outside the box");
  return space;
}

void write(StreamWriter& out, const Object& o) {
  out.put(o.path);
  out.put(o.globalId);
  out.put(o.ifcClass);
  out.put(o.operationType);
  out.putArray(o.meshes);
  out.putMatrix(o.worldFromMesh.matrix().topRows<3>());
  out.put(o.overallWidth);
  out.put(o.overallHeight);
  out.put(static_cast<std::uint8_t>(o.worldFromPlacement != nullptr));
  if (o.worldFromPlacement) out.putMatrix(o.worldFromPlacement->matrix().topRows<3>());
  out.put(static_cast<std::uint8_t>(o.usage));
  out.put(o.storey.value_or(kNone));
  out.put(o.partOf.value_or(kNone));
  out.put(o.className);
  out.put(o.thing.value_or(kNone));
  out.put(std::uint64_t{o.attributes.size()});
  for (const ObjectAttribute& attribute : o.attributes) {
    out.put(attribute.name);
    out.putArray(attribute.values);
  }
}

struct ObjectReferences {
  std::size_t meshes, storeys, objects;
};

/// The index of one of `objects`; nullopt: absent.
std::optional<std::uint32_t> readObjectIndex(StreamReader& in, std::size_t objects,
                                             const char* field) {
  const auto index = in.get<std::uint32_t>(field);
  if (index == kNone) return std::nullopt;
  if (index >= objects) in.fail(field, "no object " + std::to_string(index));
  return index;
}

/// `counts`: of what an object may refer to. In place, because there may be a million.
void readObject(StreamReader& in, const ObjectReferences& counts, Object& o) {
  o.path = in.getText("object path");
  o.globalId = in.getText("GlobalId");
  o.ifcClass = in.getText("IFC class");
  o.operationType = in.getText("operation");
  o.meshes = in.getArray<std::uint32_t>("object meshes");
  for (const std::uint32_t mesh : o.meshes) {
    if (mesh >= counts.meshes) in.fail("object meshes", "no mesh " + std::to_string(mesh));
  }
  using Rows = Eigen::Matrix<double, 3, 4>;
  o.worldFromMesh.matrix().topRows<3>() = in.getMatrix<Rows>("object transform");
  o.overallWidth = in.getFinite("overall width");
  o.overallHeight = in.getFinite("overall height");
  if (in.getBool("has a placement")) {
    Eigen::Affine3d placement = Eigen::Affine3d::Identity();
    placement.matrix().topRows<3>() = in.getMatrix<Rows>("placement");
    o.worldFromPlacement = std::make_shared<Eigen::Affine3d>(placement);
  }
  o.usage = static_cast<Object::Usage>(in.getUpTo(2, "object use"));
  o.storey = readStoreyIndex(in, counts.storeys);
  o.partOf = readObjectIndex(in, counts.objects, "piece of");
  o.className = in.getText("class");
  o.thing = readObjectIndex(in, counts.objects, "thing");
  const std::size_t attributes = in.count(16, "attributes");
  for (std::size_t i = 0; i < attributes; ++i) {
    ObjectAttribute& attribute = o.attributes.emplace_back();
    attribute.name = in.getText("attribute name");
    attribute.values = in.getArray<double>("attribute values");
    for (const double value : attribute.values)
      if (!std::isfinite(value)) in.fail("attribute values", "not a finite number");
  }
}

void write(StreamWriter& out, const PathKey& key) {
  out.put(key.time);
  out.putMatrix(key.offset);
  out.put(key.angle);
}

PathKey readPathKey(StreamReader& in) {
  PathKey key;
  key.time = in.getFinite("key time");
  key.offset = in.getMatrix<Vec3>("key offset");
  key.angle = in.getFinite("key turn");
  return key;
}

/// Numbers that every body has, in stream order.
std::array<double BodySpec::*, 8> listBodyNumbers() {
  return {&BodySpec::low,      &BodySpec::high,         &BodySpec::closedPosition,
          &BodySpec::speed,    &BodySpec::acceleration, &BodySpec::density,
          &BodySpec::friction, &BodySpec::restitution};
}

void write(StreamWriter& out, const std::optional<double>& number) {
  out.put(static_cast<std::uint8_t>(number.has_value()));
  out.put(number.value_or(0));
}

std::optional<double> readOptional(StreamReader& in, const char* field) {
  const bool there = in.getBool(field);
  const double number = in.getFinite(field);
  return there ? std::optional(number) : std::nullopt;
}

void write(StreamWriter& out, const BodySpec& b) {
  out.put(b.name);
  out.put(static_cast<std::uint8_t>(b.kind));
  out.put(static_cast<std::uint8_t>(b.source));
  out.putArray(b.objects);
  out.putMatrix(b.anchor);
  out.putMatrix(b.axis);
  for (const auto number : listBodyNumbers()) out.put(b.*number);
  out.putArray(b.stops);
  write(out, b.autoCloseDelay);
  out.put(static_cast<std::uint8_t>(b.openedBy));
  out.put(std::uint64_t{b.keys.size()});
  for (const PathKey& key : b.keys) write(out, key);
  out.put(static_cast<std::uint8_t>(b.loops));
  out.put(static_cast<std::uint8_t>(b.autoStart));
  write(out, b.mass);
  out.putMatrix(b.velocity);
  out.putMatrix(b.angularVelocity);
}

BodySpec readBodySpec(StreamReader& in) {
  BodySpec b;
  b.name = in.getText("body name");
  b.kind = static_cast<BodyKind>(in.getUpTo(kBodyKindCount - 1, "body kind"));
  b.source = static_cast<BodySource>(in.getUpTo(4, "body source"));
  b.objects = in.getArray<std::uint32_t>("body objects");
  b.anchor = in.getMatrix<Vec3>("body anchor");
  b.axis = in.getMatrix<Vec3>("body axis");
  for (const auto number : listBodyNumbers()) b.*number = in.getFinite("body number");
  b.stops = in.getArray<double>("body stops");
  b.autoCloseDelay = readOptional(in, "closes after");
  b.openedBy = static_cast<OpenedBy>(in.getUpTo(1, "opened by"));
  const std::size_t keys = in.count(40, "path keys");
  for (std::size_t i = 0; i < keys; ++i) b.keys.push_back(readPathKey(in));
  b.loops = in.getBool("loops");
  b.autoStart = in.getBool("runs");
  b.mass = readOptional(in, "mass");
  b.velocity = in.getMatrix<Vec3>("body velocity");
  b.angularVelocity = in.getMatrix<Vec3>("body spin");
  return b;
}

void write(StreamWriter& out, const Diagnostic& diagnostic) {
  out.put(diagnostic.kind);
  out.put(std::uint64_t{diagnostic.count});
  out.put(diagnostic.example);
}

Diagnostic readDiagnostic(StreamReader& in) {
  Diagnostic diagnostic;
  diagnostic.kind = in.getText("problem kind");
  diagnostic.count = in.get<std::uint64_t>("problem count");
  diagnostic.example = in.getText("problem example");
  return diagnostic;
}

template <class T>
void writeAll(StreamWriter& out, const std::vector<T>& values) {
  out.put(std::uint64_t{values.size()});
  for (const T& value : values) write(out, value);
}

/// Lets a second thread have the kernel clear the reserved memory of many values, while the first
/// of them are read. A million objects take 100,000 pages. Huge pages are no better: where the
/// memory of a virtual machine is fresh, they take five times as long. The returned thread stops
/// early if it is destroyed. Without a free thread each page is cleared when it is first written.
template <class T>
std::jthread prefaultReserved(const std::vector<T>& reserved) {
  constexpr std::size_t kManyBytes = 16 << 20;
  const std::size_t bytes = reserved.capacity() * sizeof(T);
  if (bytes < kManyBytes) return {};
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(reserved.data()) / page * page + page;
  const auto fetch = [begin,
                      end = begin + (bytes - page) / page * page](const std::stop_token& stop) {
    // In steps: each holds a lock that allocations of other threads wait for.
    constexpr std::uintptr_t kStep = 1 << 16;
    for (std::uintptr_t at = begin; at < end && !stop.stop_requested(); at += kStep) {
      const std::uintptr_t size = std::min(kStep, end - at);
      if (madvise(reinterpret_cast<void*>(at), size, MADV_POPULATE_WRITE) != 0) return;
    }
  };
  try {
    return std::jthread(fetch);
  } catch (const std::system_error&) {
    return {};
  }
}

/// `smallest`: minimum size of an item in bytes, so that a false count cannot allocate much.
/// `read` fills the next of so many items.
template <class T, class Read>
void readInPlace(StreamReader& in, std::vector<T>& values, std::size_t smallest, const char* field,
                 const Read& read) {
  const std::size_t n = in.count(smallest, field);
  values.reserve(n);  // a small multiple of the remaining bytes
  const std::jthread prefaulting = prefaultReserved(values);
  for (std::size_t i = 0; i < n; ++i) read(values.emplace_back(), n);
}
template <class T, class Read>
void readAll(StreamReader& in, std::vector<T>& values, std::size_t smallest, const char* field,
             const Read& read) {
  readInPlace(in, values, smallest, field, [&](T& value, std::size_t) { value = read(); });
}

void readHeader(StreamReader& in, std::size_t size) {
  if (in.get<std::uint32_t>("magic") != kMagic) in.fail("magic", "not a model stream");
  const auto version = in.get<std::uint32_t>("version");
  if (version != kModelStreamVersion) {
    in.fail("version", std::to_string(version) + ", but this program reads " +
                           std::to_string(kModelStreamVersion) + "; import the file again");
  }
  const auto length = in.get<std::uint64_t>("length");
  if (length != size) {
    in.fail("length",
            "says " + std::to_string(length) + " bytes, there are " + std::to_string(size));
  }
}

void writeModel(StreamWriter& out, const Model& model, std::uint64_t length) {
  out.put(kMagic);
  out.put(kModelStreamVersion);
  out.put(length);
  out.put(model.source);
  out.put(model.reader);
  writeAll(out, model.textures);
  writeAll(out, model.materials);
  writeAll(out, model.meshes);
  writeAll(out, model.storeys);
  writeAll(out, model.spaces);
  writeAll(out, model.objects);
  writeAll(out, model.bodies);
  out.put(model.metresPerUnit);
  out.put(model.map);
  out.put(static_cast<std::uint8_t>(model.north.has_value()));
  if (model.north) out.putMatrix(*model.north);
  out.put(std::uint64_t{model.fileScenes.size()});
  for (const std::string& name : model.fileScenes) out.put(name);
  out.put(model.fileScene);
  out.put(static_cast<std::uint8_t>(model.upAxis));
  out.putMatrix(model.offset);
  writeAll(out, model.diagnostics);
  out.put(std::uint64_t{model.dependencies.size()});
  for (const std::string& file : model.dependencies) out.put(file);
}

}  // namespace

std::uint64_t measureModelStream(const Model& model) {
  const ModelStreamSink none;
  StreamWriter out(none);
  writeModel(out, model, 0);
  return out.finish();
}

void writeModelStream(const Model& model, std::uint64_t size, const ModelStreamSink& sink) {
  StreamWriter out(sink);
  writeModel(out, model, size);
  if (out.finish() != size) throw ModelStreamError("model stream: its size was measured wrong");
}

std::vector<std::byte> serializeModel(const Model& model) {
  const std::uint64_t size = measureModelStream(model);
  std::vector<std::byte> bytes;
  bytes.reserve(size);
  writeModelStream(model, size, [&](std::span<const std::byte> block) {
    bytes.insert(bytes.end(), block.begin(), block.end());
  });
  return bytes;
}

Model deserializeModel(std::span<const std::byte> bytes) {
  StreamReader in(bytes);
  readHeader(in, bytes.size());
  Model model;
  model.source = in.getText("source");
  model.reader = in.getText("reader");
  readAll(in, model.textures, 24, "textures", [&] { return readTexture(in); });
  readAll(in, model.materials, 50, "materials",
          [&] { return readMaterial(in, model.textures.size()); });
  readAll(in, model.meshes, 52, "meshes", [&] { return readMesh(in, model.materials.size()); });
  readAll(in, model.storeys, 24, "storeys", [&] { return readStorey(in); });
  readAll(in, model.spaces, 29, "spaces", [&] { return readSpace(in, model.storeys.size()); });
  readInPlace(in, model.objects, 170, "objects", [&](Object& object, std::size_t count) {
    readObject(in, {model.meshes.size(), model.storeys.size(), count}, object);
  });
  readAll(in, model.bodies, 215, "bodies", [&] { return readBodySpec(in); });
  if (const auto reason = validateBodies(model)) in.fail("bodies", *reason);
  model.metresPerUnit = in.getFinite("metres per unit");
  if (model.metresPerUnit <= 0) in.fail("metres per unit", "not positive");
  model.map = in.getText("map");
  if (in.getBool("has north")) model.north = in.getMatrix<Eigen::Vector2d>("north");
  readAll(in, model.fileScenes, 8, "file scenes", [&] { return in.getText("file scene"); });
  model.fileScene = in.get<std::uint32_t>("file scene");
  if (model.fileScene > 0 && model.fileScene >= model.fileScenes.size())
    in.fail("file scene", "no such scene");
  model.upAxis = static_cast<UpAxis>(in.getUpTo(static_cast<std::uint8_t>(kLastUpAxis), "up axis"));
  model.offset = in.getMatrix<Vec3>("offset");
  readAll(in, model.diagnostics, 24, "problems", [&] { return readDiagnostic(in); });
  readAll(in, model.dependencies, 8, "dependencies", [&] { return in.getText("dependency"); });
  if (in.remaining() != 0) in.fail("end", std::to_string(in.remaining()) + " bytes too many");
  return model;
}

}  // namespace enfilade::scene
