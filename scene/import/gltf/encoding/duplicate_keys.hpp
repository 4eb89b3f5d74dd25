// Finds duplicate keys in the objects of a glTF file's JSON. Readers use different values:
// nlohmann-json takes the last, assimp the first. Private to the import.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <vector>

namespace enfilade::scene {

class DuplicateKeys {
 public:
  /// Call these for each key, value and begin of a container in order. `depth`: of open containers.
  void seeKey(std::size_t depth, const std::string& key);
  void seeValue(std::size_t depth);  ///< one that is no container
  void seeStart(std::size_t depth, bool isArray);

  std::size_t count() const { return count_; }
  const std::string& firstPath() const { return firstPath_; }  ///< e.g. "nodes[3].translation"

 private:
  /// An object or array that is being read.
  struct Container {
    bool isArray = false;
    std::size_t elements = 0;       ///< of an array, so far
    std::vector<std::string> keys;  ///< the first of an object; those beyond keyCount are unused
    std::size_t keyCount = 0;
    std::set<std::string> moreKeys;  ///< of an object that has many
    std::string lastKey;
  };

  static bool addKey(Container& object, const std::string& key);
  std::string makePath(std::size_t depth) const;

  std::vector<Container> open_;  ///< by depth
  std::size_t count_ = 0;
  std::string firstPath_;
};

}  // namespace enfilade::scene
