// Reads numbers from a glTF file's buffers with bounds checks. Private to the import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/file/model_format.hpp"

namespace enfilade::scene {

class GltfBuffers {
 public:
  /// `json` must outlive this object. Throws ImportError.
  GltfBuffers(std::filesystem::path file, ModelFormat format, const nlohmann::json& json);

  /// All components of an accessor of floats or normalised integers, `perElement` per element.
  /// Throws ImportError, also for any other type.
  std::vector<double> readNumbers(std::size_t accessor, std::size_t perElement);

 private:
  struct Slice {
    const std::string* bytes;
    std::size_t first, stride;
  };
  [[noreturn]] void fail(const std::string& message) const;
  const nlohmann::json& getEntry(const char* list, std::size_t index) const;
  std::size_t getInteger(const nlohmann::json& object, const char* key, std::size_t fallback) const;
  const std::string& getBuffer(std::size_t index);
  std::string readBuffer(std::size_t index) const;
  Slice makeSlice(const nlohmann::json& accessor, std::size_t elementBytes, std::size_t count);

  std::filesystem::path file_;
  ModelFormat format_;
  const nlohmann::json& json_;
  std::map<std::size_t, std::string> buffers_;
};

}  // namespace enfilade::scene
