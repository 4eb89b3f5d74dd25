#include "scene/import/gltf/encoding/meshopt_view.hpp"

#include <meshoptimizer.h>

#include <array>

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

/// Returns the library's result, 0 for success; checks what the library only asserts.
int decodeMeshoptMode(const MeshoptView& view, std::string& bytes) {
  const auto* source = reinterpret_cast<const unsigned char*>(view.source.data());
  const std::size_t size = view.source.size();
  if (view.mode == "ATTRIBUTES")
    return meshopt_decodeVertexBuffer(bytes.data(), view.count, view.stride, source, size);
  if (view.mode == "TRIANGLES")
    return meshopt_decodeIndexBuffer(bytes.data(), view.count, view.stride, source, size);
  return meshopt_decodeIndexSequence(bytes.data(), view.count, view.stride, source, size);
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
  return view.filter == "EXPONENTIAL" ? "" : "unsupported compression filter '" + view.filter + "'";
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
  bytes.assign(view.count * view.stride, '\0');
  if (view.count == 0) return "";
  // The high four bits of the first byte name the codec, the low ones its version.
  if (view.mode == "ATTRIBUTES" && view.source.starts_with('\xa1'))
    return "compressed by version 1 of the vertex codec, which is not supported; compress with "
           "EXT_meshopt_compression";
  if (decodeMeshoptMode(view, bytes) != 0) return "its compressed data is damaged";
  if (view.filter == "OCTAHEDRAL") meshopt_decodeFilterOct(bytes.data(), view.count, view.stride);
  if (view.filter == "QUATERNION") meshopt_decodeFilterQuat(bytes.data(), view.count, view.stride);
  if (view.filter == "EXPONENTIAL") meshopt_decodeFilterExp(bytes.data(), view.count, view.stride);
  return "";
}

}  // namespace enfilade::scene
