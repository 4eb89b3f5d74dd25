// The header is read here first, because Draco allocates by its counts alone: Draco bit stream 2.2,
// sections "Draco header", "Sequential" and "EdgeBreaker connectivity".
#include "scene/import/gltf/encoding/draco_mesh.hpp"

#include <draco/compression/decode.h>
#include <draco/core/varint_decoding.h>
#include <draco/metadata/metadata_decoder.h>

#include <array>
#include <exception>
#include <limits>

namespace enfilade::scene {
namespace {

constexpr std::size_t kDracoHeaderSize = 11;  // bytes
constexpr std::uint16_t kDracoMetadataFlag = 0x8000;
/// Triangles per byte, and those of any file. A flat grid of two million triangles with positions
/// of 11 bits has 3.5 per byte; the rest is margin for coarser positions.
constexpr std::uint64_t kMaxDracoDensity = 64, kFreeDracoTriangles = 4096;

struct DracoCounts {
  std::uint32_t faces = 0, points = 0;
};

/// Reads the counts that follow header and metadata; false if they are missing.
bool readDracoCounts(draco::DecoderBuffer& buffer, bool edgebreaker, bool metadata,
                     DracoCounts& counts) {
  buffer.set_bitstream_version(DRACO_BITSTREAM_VERSION(2, 2));
  if (metadata) {
    draco::GeometryMetadata skipped;
    if (!draco::MetadataDecoder().DecodeGeometryMetadata(&buffer, &skipped)) return false;
  }
  if (!edgebreaker)
    return draco::DecodeVarint(&counts.faces, &buffer) &&
           draco::DecodeVarint(&counts.points, &buffer);
  std::uint8_t traversal = 0;
  return buffer.Decode(&traversal) && draco::DecodeVarint(&counts.points, &buffer) &&
         draco::DecodeVarint(&counts.faces, &buffer);
}

/// Returns why the data cannot be decoded within bounds; "" if it can be tried.
std::string findDracoFault(std::string_view bytes) {
  if (bytes.size() < kDracoHeaderSize || !bytes.starts_with("DRACO"))
    return "its Draco data is damaged";
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(bytes[at]); };
  if (byte(5) != 2 || byte(6) != 2)
    return "its Draco data is not of bit stream version 2.2, which glTF requires";
  if (byte(7) != 1 || byte(8) > 1) return "its Draco data is not a triangle mesh";
  const unsigned flags = byte(9) | byte(10) << 8U;
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data() + kDracoHeaderSize, bytes.size() - kDracoHeaderSize);
  DracoCounts counts;
  if (!readDracoCounts(buffer, byte(8) == 1, (flags & kDracoMetadataFlag) != 0, counts))
    return "its Draco data is cut off";
  const std::uint64_t limit = kMaxDracoDensity * bytes.size() + kFreeDracoTriangles;
  if (counts.faces > limit || counts.points > 3 * limit)
    return "its Draco header claims " + std::to_string(counts.faces) + " triangles and " +
           std::to_string(counts.points) + " vertices, more than " + std::to_string(bytes.size()) +
           " bytes can contain";
  return "";
}

/// The factor of an integer attribute whose normalisation only the accessor states.
float getDracoScale(const draco::PointAttribute& attribute, bool normalised) {
  if (!normalised || attribute.normalized()) return 1;
  switch (attribute.data_type()) {
    case draco::DT_INT8:
      return 1.0f / std::numeric_limits<std::int8_t>::max();
    case draco::DT_UINT8:
      return 1.0f / std::numeric_limits<std::uint8_t>::max();
    case draco::DT_INT16:
      return 1.0f / std::numeric_limits<std::int16_t>::max();
    case draco::DT_UINT16:
      return 1.0f / std::numeric_limits<std::uint16_t>::max();
    default:
      return 1;
  }
}

bool copyDracoAttribute(const draco::Mesh& from, const DracoAttribute& wanted,
                        std::vector<float>& to) {
  const draco::PointAttribute* attribute = from.GetAttributeByUniqueId(wanted.id);
  if (attribute == nullptr || wanted.width > 4) return false;
  const float scale = getDracoScale(*attribute, wanted.normalised);
  std::array<float, 4> value{};
  to.reserve(from.num_points() * wanted.width);
  for (draco::PointIndex point(0); point < from.num_points(); ++point) {
    if (!attribute->ConvertValue<float>(attribute->mapped_index(point),
                                        static_cast<std::int8_t>(wanted.width), value.data()))
      return false;
    for (std::size_t i = 0; i < wanted.width; ++i) to.push_back(value[i] * scale);
  }
  return true;
}

}  // namespace

std::string decodeDracoMesh(std::string_view bytes, const DracoAttributes& wanted,
                            DracoMesh& mesh) {
  if (std::string fault = findDracoFault(bytes); !fault.empty()) return fault;
  draco::DecoderBuffer buffer;
  buffer.Init(bytes.data(), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok())
    return std::string("its Draco data is damaged: ") + decoded.status().error_msg();
  const draco::Mesh& from = *decoded.value();
  mesh.indices.reserve(std::size_t{from.num_faces()} * 3);
  for (draco::FaceIndex face(0); face < from.num_faces(); ++face) {
    for (const auto& corner : from.face(face)) mesh.indices.push_back(corner.value());
  }
  for (const auto& [name, attribute] : wanted) {
    if (!copyDracoAttribute(from, attribute, mesh.attributes[name]))
      return "its Draco data has no attribute " + std::to_string(attribute.id) + " for " + name;
  }
  return "";
}

}  // namespace enfilade::scene
