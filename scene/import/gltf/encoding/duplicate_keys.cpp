#include "scene/import/gltf/encoding/duplicate_keys.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

// Of an object. Few objects of glTF have more, and up to here a list is quicker than a tree.
constexpr std::size_t kMaxListedKeys = 16;

}  // namespace

void DuplicateKeys::seeStart(std::size_t depth, bool isArray) {
  seeValue(depth);
  if (open_.size() <= depth) open_.resize(depth + 1);
  Container& container = open_[depth];
  container.isArray = isArray;
  container.elements = container.keyCount = 0;
  container.moreKeys.clear();
}

void DuplicateKeys::seeValue(std::size_t depth) {
  if (depth > 0 && open_[depth - 1].isArray) ++open_[depth - 1].elements;
}

void DuplicateKeys::seeKey(std::size_t depth, const std::string& key) {
  Container& object = open_[depth - 1];
  object.lastKey = key;
  if (addKey(object, key)) return;
  if (count_ == 0) firstPath_ = makePath(depth);
  ++count_;
}

/// Returns whether the object did not have the key. The strings of keys are reused, since a file
/// may have a million objects.
bool DuplicateKeys::addKey(Container& object, const std::string& key) {
  const auto end = object.keys.begin() + static_cast<std::ptrdiff_t>(object.keyCount);
  if (std::find(object.keys.begin(), end, key) != end) return false;
  if (object.keyCount == kMaxListedKeys) return object.moreKeys.insert(key).second;
  if (end == object.keys.end()) object.keys.emplace_back();
  object.keys[object.keyCount++] = key;
  return true;
}

std::string DuplicateKeys::makePath(std::size_t depth) const {
  std::string path;
  for (std::size_t i = 0; i < depth; ++i) {
    if (open_[i].isArray) {
      path += "[" + std::to_string(open_[i].elements - 1) + "]";
    } else {
      path += (path.empty() ? "" : ".") + open_[i].lastKey;
    }
  }
  return path;
}

}  // namespace enfilade::scene
