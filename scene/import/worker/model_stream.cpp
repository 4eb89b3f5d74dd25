#include "scene/import/worker/model_stream.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace enfilade::scene {
namespace {

static_assert(std::endian::native == std::endian::little, "the stream has memory byte order");

constexpr std::uint32_t kNone = 0xffffffff;   // an absent index
constexpr std::uint32_t kMagic = 0x4d464e45;  // "ENFM"

/// Scalars of a vector of scalars or of fixed-size Eigen vectors, which lie without gaps.
template <class T>
constexpr std::size_t kPackedSize = sizeof(T);
static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(Eigen::Vector2f) == 8);

class StreamWriter {
 public:
  template <class T>
  requires std::is_arithmetic_v<T>
  void put(T value) { append(&value, sizeof value); }
  void put(const std::string& text) {
    put(std::uint64_t{text.size()});
    append(text.data(), text.size());
  }
  template <class T>
  void putArray(const std::vector<T>& values) {
    put(std::uint64_t{values.size()});
    append(values.data(), values.size() * kPackedSize<T>);
  }
  template <class Derived>
  void putMatrix(const Eigen::MatrixBase<Derived>& m) {
    for (Eigen::Index r = 0; r < m.rows(); ++r) {
      for (Eigen::Index c = 0; c < m.cols(); ++c) put(m(r, c));
    }
  }
  void reserve(std::size_t size) { bytes_.reserve(size); }

  std::vector<std::byte> finish() {
    const std::uint64_t size = bytes_.size();
    std::memcpy(bytes_.data() + 8, &size, sizeof size);
    return std::move(bytes_);
  }

 private:
  void append(const void* data, std::size_t size) {
    if (size == 0) return;
    const auto* begin = static_cast<const std::byte*>(data);
    bytes_.insert(bytes_.end(), begin, begin + size);
  }
  std::vector<std::byte> bytes_;
};

class StreamReader {
 public:
  explicit StreamReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  template <class T>
  requires std::is_arithmetic_v<T> T get(const char* field) {
    T value;
    take(&value, sizeof value, field);
    return value;
  }
  bool getBool(const char* field) { return getUpTo(1, field) == 1; }
  std::uint8_t getUpTo(std::uint8_t maxValue, const char* field) {
    const auto value = get<std::uint8_t>(field);
    if (value > maxValue) fail(field, "value " + std::to_string(value) + " is unknown");
    return value;
  }
  double getFinite(const char* field) {
    const double value = get<double>(field);
    if (!std::isfinite(value)) fail(field, "not a finite number");
    return value;
  }
  std::string getText(const char* field) {
    std::string text(count(1, field), '\0');
    take(text.data(), text.size(), field);
    return text;
  }
  std::vector<std::uint8_t> getBytes(const char* field) {
    const std::size_t size = count(1, field);
    const auto* first = reinterpret_cast<const std::uint8_t*>(bytes_.data() + position_);
    position_ += size;
    return {first, first + size};
  }
  template <class T>
  std::vector<T> getArray(const char* field) {
    std::vector<T> values(count(kPackedSize<T>, field));
    take(values.data(), values.size() * kPackedSize<T>, field);
    return values;
  }
  template <class Matrix>
  Matrix getMatrix(const char* field) {
    Matrix m;
    for (Eigen::Index r = 0; r < m.rows(); ++r) {
      for (Eigen::Index c = 0; c < m.cols(); ++c) {
        m(r, c) = get<typename Matrix::Scalar>(field);
        if (!std::isfinite(m(r, c))) fail(field, "not a finite number");
      }
    }
    return m;
  }
  /// Reads a count of items that take at least `smallest` bytes each.
  std::size_t count(std::size_t smallest, const char* field) {
    const auto n = get<std::uint64_t>(field);
    if (n > remaining() / smallest) {
      fail(field, "count " + std::to_string(n) + " exceeds the " + std::to_string(remaining()) +
                      " bytes that remain");
    }
    return static_cast<std::size_t>(n);
  }
  std::size_t remaining() const { return bytes_.size() - position_; }

  [[noreturn]] void fail(const char* field, const std::string& what) const {
    throw ModelStreamError("model stream, byte " + std::to_string(position_) + ", " + field + ": " +
                           what);
  }

 private:
  void take(void* to, std::size_t size, const char* field) {
    if (size > remaining()) fail(field, "the stream ends here");
    // Eigen vectors are plain arrays of scalars, as checked above; hence void.
    if (size > 0) std::memcpy(to, bytes_.data() + position_, size);
    position_ += size;
  }

  std::span<const std::byte> bytes_;
  std::size_t position_ = 0;
};

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
  out.putArray(m.indices);
  out.put(m.material);
}

Mesh readMesh(StreamReader& in, std::size_t materials) {
  Mesh m;
  m.name = in.getText("mesh name");
  m.positions = in.getArray<Eigen::Vector3f>("positions");
  m.normals = in.getArray<Eigen::Vector3f>("normals");
  m.uvs = in.getArray<Eigen::Vector2f>("uvs");
  m.indices = in.getArray<std::uint32_t>("indices");
  m.material = in.get<std::uint32_t>("mesh material");
  const std::size_t n = m.positions.size();
  for (const Eigen::Vector3f& p : m.positions) {
    if (!p.allFinite()) in.fail("positions", "not a finite number");
  }
  if (!m.normals.empty() && m.normals.size() != n) in.fail("normals", "not one per position");
  if (!m.uvs.empty() && m.uvs.size() != n) in.fail("uvs", "not one per position");
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
  out.put(static_cast<std::uint8_t>(o.worldFromPlacement.has_value()));
  if (o.worldFromPlacement) out.putMatrix(o.worldFromPlacement->matrix().topRows<3>());
  out.put(static_cast<std::uint8_t>(o.usage));
  out.put(o.storey.value_or(kNone));
  out.put(o.partOf.value_or(kNone));
  out.put(o.className);
  out.put(o.thing.value_or(kNone));
}

/// Parts may precede their whole; that index is checked when all objects are read.
Object readObject(StreamReader& in, std::size_t meshes, std::size_t storeys) {
  Object o;
  o.path = in.getText("object path");
  o.globalId = in.getText("GlobalId");
  o.ifcClass = in.getText("IFC class");
  o.operationType = in.getText("operation");
  o.meshes = in.getArray<std::uint32_t>("object meshes");
  for (const std::uint32_t mesh : o.meshes) {
    if (mesh >= meshes) in.fail("object meshes", "no mesh " + std::to_string(mesh));
  }
  using Rows = Eigen::Matrix<double, 3, 4>;
  o.worldFromMesh.matrix().topRows<3>() = in.getMatrix<Rows>("object transform");
  o.overallWidth = in.getFinite("overall width");
  o.overallHeight = in.getFinite("overall height");
  if (in.getBool("has a placement")) {
    o.worldFromPlacement.emplace(Eigen::Affine3d::Identity());
    o.worldFromPlacement->matrix().topRows<3>() = in.getMatrix<Rows>("placement");
  }
  o.usage = static_cast<Object::Usage>(in.getUpTo(2, "object use"));
  o.storey = readStoreyIndex(in, storeys);
  const auto whole = in.get<std::uint32_t>("piece of");
  if (whole != kNone) o.partOf = whole;
  o.className = in.getText("class");
  const auto thing = in.get<std::uint32_t>("thing");
  if (thing != kNone) o.thing = thing;
  return o;
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

/// `smallest`: minimum size of an item in bytes, so that a false count cannot allocate much.
template <class T, class Read>
void readAll(StreamReader& in, std::vector<T>& values, std::size_t smallest, const char* field,
             const Read& read) {
  const std::size_t n = in.count(smallest, field);
  values.reserve(n);  // a small multiple of the remaining bytes
  for (std::size_t i = 0; i < n; ++i) values.push_back(read());
}

std::size_t estimateSize(const Model& model) {
  std::size_t size = 1024 + model.objects.size() * 256;
  for (const Texture& t : model.textures) size += t.rgba.size() + 256;
  for (const Mesh& m : model.meshes) size += m.positions.size() * 32 + m.indices.size() * 4 + 256;
  return size;
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

}  // namespace

std::vector<std::byte> serialiseModel(const Model& model) {
  StreamWriter out;
  out.reserve(estimateSize(model));
  out.put(kMagic);
  out.put(kModelStreamVersion);
  out.put(std::uint64_t{0});  // the length, set by finish()
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
  out.put(static_cast<std::uint8_t>(model.upAxis));
  out.putMatrix(model.offset);
  writeAll(out, model.diagnostics);
  out.put(std::uint64_t{model.dependencies.size()});
  for (const std::string& file : model.dependencies) out.put(file);
  return out.finish();
}

Model deserialiseModel(std::span<const std::byte> bytes) {
  StreamReader in(bytes);
  readHeader(in, bytes.size());
  Model model;
  model.source = in.getText("source");
  model.reader = in.getText("reader");
  readAll(in, model.textures, 24, "textures", [&] { return readTexture(in); });
  readAll(in, model.materials, 50, "materials",
          [&] { return readMaterial(in, model.textures.size()); });
  readAll(in, model.meshes, 44, "meshes", [&] { return readMesh(in, model.materials.size()); });
  readAll(in, model.storeys, 24, "storeys", [&] { return readStorey(in); });
  readAll(in, model.spaces, 29, "spaces", [&] { return readSpace(in, model.storeys.size()); });
  readAll(in, model.objects, 162, "objects",
          [&] { return readObject(in, model.meshes.size(), model.storeys.size()); });
  for (const Object& object : model.objects) {
    if (object.partOf && *object.partOf >= model.objects.size())
      in.fail("piece of", "no object " + std::to_string(*object.partOf));
    if (object.thing && *object.thing >= model.objects.size())
      in.fail("thing", "no object " + std::to_string(*object.thing));
  }
  readAll(in, model.bodies, 215, "bodies", [&] { return readBodySpec(in); });
  if (const auto reason = validateBodies(model)) in.fail("bodies", *reason);
  model.metresPerUnit = in.getFinite("metres per unit");
  if (model.metresPerUnit <= 0) in.fail("metres per unit", "not positive");
  model.map = in.getText("map");
  model.upAxis = static_cast<char>(in.get<std::uint8_t>("up axis"));
  if (model.upAxis < 'x' || model.upAxis > 'z') in.fail("up axis", "neither x, y nor z");
  model.offset = in.getMatrix<Vec3>("offset");
  readAll(in, model.diagnostics, 24, "problems", [&] { return readDiagnostic(in); });
  readAll(in, model.dependencies, 8, "dependencies", [&] { return in.getText("dependency"); });
  if (in.remaining() != 0) in.fail("end", std::to_string(in.remaining()) + " bytes too many");
  return model;
}

}  // namespace enfilade::scene
