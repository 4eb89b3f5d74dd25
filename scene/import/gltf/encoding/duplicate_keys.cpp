#include "scene/import/gltf/encoding/duplicate_keys.hpp"

#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {

void DuplicateKeys::see(int level, nlohmann::json::parse_event_t event,
                        const nlohmann::json& value) {
  using Event = nlohmann::json::parse_event_t;
  if (level > kMaxJsonDepth) return;  // the file is refused
  const auto depth = static_cast<std::size_t>(level);
  if (event == Event::key) {
    addKey(depth, value.get_ref<const std::string&>());
  } else if (event == Event::value) {
    countElement(depth);
  } else if (event == Event::object_start || event == Event::array_start) {
    countElement(depth);
    open(depth, event == Event::array_start);
  }
}

void DuplicateKeys::open(std::size_t depth, bool isArray) {
  if (open_.size() <= depth) open_.resize(depth + 1);
  open_[depth].isArray = isArray;
  open_[depth].elements = 0;
  open_[depth].keys.clear();
}

void DuplicateKeys::countElement(std::size_t depth) {
  if (depth > 0 && open_[depth - 1].isArray) ++open_[depth - 1].elements;
}

void DuplicateKeys::addKey(std::size_t depth, const std::string& key) {
  Container& object = open_[depth - 1];
  object.lastKey = key;
  if (object.keys.insert(key).second) return;
  if (count_ == 0) firstPath_ = makePath(depth);
  ++count_;
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
