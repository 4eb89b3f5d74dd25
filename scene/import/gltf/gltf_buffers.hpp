// Numbers out of a glTF file's buffers, each access checked against what is there. Private to the
// import.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scene/import/file_metadata.hpp"

namespace enfilade::scene {

class GltfBuffers {
 public:
  /// `json` must live longer. Throws ImportError.
  GltfBuffers(std::filesystem::path file, ModelFormat format, const nlohmann::json& json);

  /// All components of an accessor of floats or normalised integers, `perElement` of them each.
  /// Throws ImportError, also for another type.
  std::vector<double> numbers(std::size_t accessor, std::size_t perElement);

 private:
  struct Slice {
    const std::string* bytes;
    std::size_t first, stride;
  };
  [[noreturn]] void refuse(const std::string& what) const;
  const nlohmann::json& entry(const char* list, std::size_t index) const;
  std::size_t whole(const nlohmann::json& object, const char* key, std::size_t otherwise) const;
  const std::string& buffer(std::size_t index);
  std::string read(std::size_t index) const;
  Slice sliceOf(const nlohmann::json& accessor, std::size_t elementBytes, std::size_t count);

  std::filesystem::path file_;
  ModelFormat format_;
  const nlohmann::json& json_;
  std::map<std::size_t, std::string> buffers_;
};

}  // namespace enfilade::scene
