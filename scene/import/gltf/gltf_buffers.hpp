// Reads a glTF file's buffers: buffer views, compressed or not, and accessors, sparse or not. Every
// size is checked before anything is allocated. Private to the import.
//
// The rule for sizes: what a file decodes to is at most kMaxExpansion times its own bytes and those
// of its buffers, plus a constant. No codec of a valid file comes near it. A triangle takes at
// least one byte of EXT_meshopt_compression, and 64 bytes of vertices at least one.
#pragma once

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "scene/import/file/import_options.hpp"
#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

/// An error that makes the whole file unreadable, not one of its meshes: a missing buffer, or more
/// data than the file can contain.
struct UnreadableGltf : ImportError {
  using ImportError::ImportError;
};

/// The elements of an accessor, without gaps, as the file stores them.
struct GltfElements {
  std::size_t count = 0, width = 0;  ///< `width`: components of an element
  std::size_t componentType = 0;     ///< of glTF 2.0, 3.6.2.2
  bool normalised = false;
  std::string bytes;
};

class GltfBuffers {
 public:
  /// `json` must outlive this object. Throws ImportError.
  GltfBuffers(std::filesystem::path file, ModelFormat format, const nlohmann::json& json);

  /// All components of an accessor of floats or normalised integers, `perElement` per element.
  /// Throws ImportError, also for any other type.
  std::vector<double> readNumbers(std::size_t accessor, std::size_t perElement);

  /// All components as floats; integers are normalised if the accessor says so, or if `normalise`
  /// does. May contain NaN.
  std::vector<float> readFloats(std::size_t accessor, std::size_t perElement,
                                bool normalise = false);

  /// All components of an accessor of scalars or vectors, as the file means them. Sets their number
  /// per element. Integers keep all digits.
  std::vector<double> readValues(std::size_t accessor, std::size_t& perElement);

  /// The unsigned integers of an accessor of scalars.
  std::vector<std::uint32_t> readIndices(std::size_t accessor);

  /// The bytes of a buffer view, decompressed. Valid as long as this object.
  std::string_view getView(std::size_t view);

  /// Counts bytes that the caller is about to allocate for `what`. Throws ImportError if the file
  /// cannot justify them.
  void spend(std::size_t count, std::size_t bytesEach, const std::string& what);

  /// Throws ImportError with the file's name and the remedy.
  [[noreturn]] void fail(const std::string& message) const;

  /// Files that were read or looked for.
  const std::vector<std::string>& dependencies() const { return dependencies_; }

 private:
  const nlohmann::json& getEntry(const char* list, std::size_t index) const;
  std::size_t getInteger(const nlohmann::json& object, const char* key, std::size_t fallback) const;
  const std::string& getBuffer(std::size_t index);
  std::string readBuffer(std::size_t index);
  std::string_view sliceBuffer(const nlohmann::json& place, const std::string& name);
  std::string decodeView(const nlohmann::json& compressed, const std::string& name);
  GltfElements readElements(std::size_t accessor, std::size_t width);
  void copyElements(std::size_t view, std::size_t offset, std::size_t elementBytes,
                    std::size_t count, const std::string& name, std::string& to);
  void applySparse(const nlohmann::json& sparse, const std::string& name, GltfElements& to);

  std::filesystem::path file_;
  ModelFormat format_;
  const nlohmann::json& json_;
  std::map<std::size_t, std::string> buffers_, decodedViews_;
  std::vector<std::string> dependencies_;
  std::size_t loaded_ = 0, decoded_ = 0;  // bytes
};

}  // namespace enfilade::scene
