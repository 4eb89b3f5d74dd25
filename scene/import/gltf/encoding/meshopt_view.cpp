#include "scene/import/gltf/encoding/meshopt_view.hpp"

#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

#include "scene/import/gltf/encoding/gltf_json.hpp"
#include "scene/import/gltf/encoding/meshopt_vertices.hpp"

namespace enfilade::scene {
namespace {

/// Returns "", or the reason why it failed.
std::string decodeMeshoptMode(const MeshoptView& view, std::string& bytes) {
  if (view.mode == "ATTRIBUTES")
    return decodeMeshoptVertices(view.source, view.count, view.stride, bytes);
  const auto* source = reinterpret_cast<const unsigned char*>(view.source.data());
  const std::size_t size = view.source.size();
  // Each triangle takes a byte at least, as does each index of a sequence.
  if (view.count / (view.mode == "TRIANGLES" ? 3 : 1) > size)
    return "its compressed data ends too early";
  bytes.assign(view.count * view.stride, '\0');
  const int result =
      view.mode == "TRIANGLES"
          ? meshopt_decodeIndexBuffer(bytes.data(), view.count, view.stride, source, size)
          : meshopt_decodeIndexSequence(bytes.data(), view.count, view.stride, source, size);
  return result == 0 ? "" : "its compressed data is damaged";
}

/// Returns what is wrong with the sizes of the view; "" for a valid view.
std::string findMeshoptFault(const MeshoptView& view) {
  const bool index = view.mode == "TRIANGLES" || view.mode == "INDICES";
  if (!index && view.mode != "ATTRIBUTES") return "unknown compression mode '" + view.mode + "'";
  if (index && view.stride != 2 && view.stride != 4) return "indices of neither 2 nor 4 bytes";
  if (!index && (view.stride == 0 || view.stride > 256 || view.stride % 4 != 0))
    return "its byteStride is not a multiple of 4 up to 256";
  if (view.mode == "TRIANGLES" && view.count % 3 != 0) return "its count is not a multiple of 3";
  if (view.filter == "NONE") return "";
  if (index) return "a filter on indices";
  if (view.filter == "OCTAHEDRAL")
    return view.stride == 4 || view.stride == 8 ? ""
                                                : "octahedral elements of neither 4 nor 8 bytes";
  if (view.filter == "QUATERNION") return view.stride == 8 ? "" : "quaternions not of 8 bytes";
  if (view.filter == "COLOR")
    return view.stride == 4 || view.stride == 8 ? "" : "colours of neither 4 nor 8 bytes";
  return view.filter == "EXPONENTIAL" ? "" : "unsupported compression filter '" + view.filter + "'";
}

/// Decodes Y, Co, Cg and alpha of K bits to RGBA in place. K is the place of alpha's highest bit
/// (KHR_meshopt_compression, appendix B, filter 4). False if a K is not valid.
template <class Channel>
bool decodeColourFilter(std::string& bytes) {
  constexpr double kFull = std::numeric_limits<Channel>::max();
  std::array<Channel, 4> element{};
  for (std::size_t at = 0; at < bytes.size(); at += sizeof element) {
    std::memcpy(element.data(), bytes.data() + at, sizeof element);
    const int bits = std::bit_width(element[3]);
    if (bits < 2) return false;
    const int full = (1 << bits) - 1;
    const int y = element[0], co = static_cast<std::make_signed_t<Channel>>(element[1]),
              cg = static_cast<std::make_signed_t<Channel>>(element[2]);
    const int alpha = element[3] & (full >> 1);  // of one bit less, whose last bit is repeated
    const std::array<int, 4> rgba{y + co - cg, y + cg, y - co - cg, alpha << 1 | (alpha & 1)};
    for (std::size_t i = 0; i < rgba.size(); ++i)
      element[i] = static_cast<Channel>(std::lround(std::clamp(rgba[i], 0, full) * (kFull / full)));
    std::memcpy(bytes.data() + at, element.data(), sizeof element);
  }
  return true;
}

/// Returns whether the filter's input is valid.
bool applyMeshoptFilter(const MeshoptView& view, std::string& bytes) {
  if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(bytes.data(), view.count, view.stride);
  if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(bytes.data(), view.count, view.stride);
  if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(bytes.data(), view.count, view.stride);
  if (view.filter != "COLOR") return true;
  return view.stride == 4 ? decodeColourFilter<std::uint8_t>(bytes)
                          : decodeColourFilter<std::uint16_t>(bytes);
}

}  // namespace

const nlohmann::json* findMeshoptExtension(const nlohmann::json& view) {
  const nlohmann::json* extensions = findMember(&view, "extensions");
  for (const char* name : {"EXT_meshopt_compression", "KHR_meshopt_compression"}) {
    const nlohmann::json* found = findMember(extensions, name);
    if (found != nullptr && found->is_object()) return found;
  }
  return nullptr;
}

std::string decodeMeshoptView(const MeshoptView& view, std::string& bytes) {
  if (std::string fault = findMeshoptFault(view); !fault.empty()) return fault;
  bytes.clear();
  if (view.count == 0) return "";
  if (std::string fault = decodeMeshoptMode(view, bytes); !fault.empty()) return fault;
  return applyMeshoptFilter(view, bytes) ? "" : "its compressed colours are damaged";
}

}  // namespace enfilade::scene
