// Finds keys that stand twice in one object of a glTF file's JSON. Readers differ on which of the
// values counts: nlohmann-json takes the last, assimp the first. Private to the import.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

namespace enfilade::scene {

class DuplicateKeys {
 public:
  /// Call it for each event of nlohmann::json::parse() in order. The parser reports no ends of
  /// containers that its callback discards, so beginnings alone are used.
  void see(int depth, nlohmann::json::parse_event_t event, const nlohmann::json& value);

  std::size_t count() const { return count_; }
  const std::string& firstPath() const { return firstPath_; }  ///< e.g. "nodes[3].translation"

 private:
  /// An object or array that is being read.
  struct Container {
    bool isArray = false;
    std::size_t elements = 0;    ///< of an array, so far
    std::set<std::string> keys;  ///< of an object, so far
    std::string lastKey;
  };

  void open(std::size_t depth, bool isArray);
  void countElement(std::size_t depth);
  void addKey(std::size_t depth, const std::string& key);
  std::string makePath(std::size_t depth) const;

  std::vector<Container> open_;  ///< by depth
  std::size_t count_ = 0;
  std::string firstPath_;
};

}  // namespace enfilade::scene
