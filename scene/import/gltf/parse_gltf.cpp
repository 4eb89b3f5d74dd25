// nlohmann-json's callback parser scans all elements of an array at the end of each element, which
// is quadratic. Its SAX parser does not.
#include "scene/import/gltf/parse_gltf.hpp"

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "scene/import/file/import_options.hpp"
#include "scene/import/gltf/encoding/gltf_json.hpp"

namespace enfilade::scene {
namespace {

using Json = nlohmann::json;

constexpr std::array<std::string_view, 14> kSections{"asset",          "extensionsRequired",
                                                     "extensionsUsed", "meshes",
                                                     "accessors",      "buffers",
                                                     "bufferViews",    "materials",
                                                     "textures",       "images",
                                                     "samplers",       "cameras",
                                                     "scenes",         "scene"};

bool isSection(std::string_view key) {
  return std::ranges::find(kSections, key) != kSections.end();
}

class GltfHandler : public nlohmann::json_sax<Json> {
 public:
  GltfHandler(const std::filesystem::path& file, ParsedGltf& to) : file_(file), to_(to) {}

  bool null() override { return addValue(nullptr); }
  bool boolean(bool value) override { return addValue(value); }
  bool number_integer(number_integer_t value) override { return addValue(value); }
  bool number_unsigned(number_unsigned_t value) override { return addValue(value); }
  bool number_float(number_float_t value, const string_t&) override { return addValue(value); }
  bool string(string_t& value) override { return addValue(std::move(value)); }
  bool binary(binary_t&) override { return false; }  // not in JSON

  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& name) override {
    const std::size_t depth = countOpen();
    to_.duplicates.seeKey(depth, name);
    to_.extensions.seeKey(static_cast<int>(depth), name);
    if (depth == 1) {
      inNodes_ = name == "nodes";
      if (inNodes_) to_.nodes.clear(), to_.hasWrongNodes = false;  // the last of several counts
      isKept_ = isSection(name);
    }
    key_ = std::move(name);
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    if (dynamic_cast<const Json::out_of_range*>(&error) != nullptr)
      failJson(file_, "has a number that is too large");
    failJson(file_, "is damaged (byte " + std::to_string(position) + ")");
  }

 private:
  std::size_t countOpen() const {
    if (open_.size() > static_cast<std::size_t>(kMaxJsonDepth))
      failJson(file_, "is nested deeper than " + std::to_string(kMaxJsonDepth) + " levels");
    return open_.size();
  }

  bool isInListOfNodes() const { return inNodes_ && open_.size() == 2; }

  /// Puts a value into the innermost open container. Null: it is not kept.
  Json* place(Json value) {
    if (open_.empty()) return &(to_.sections = std::move(value));
    if (isInListOfNodes()) return &(node_ = std::move(value));
    Json* const container = open_.back();
    if (container == nullptr || (open_.size() == 1 && !isKept_)) return nullptr;
    if (container->is_object()) return &((*container)[key_] = std::move(value));
    container->push_back(std::move(value));
    return &container->back();
  }

  bool addValue(Json value) {
    const std::size_t depth = countOpen();
    to_.duplicates.seeValue(depth);
    to_.extensions.seeValue(value);
    place(std::move(value));
    if (depth == 1 && inNodes_) to_.hasWrongNodes = true;
    if (isInListOfNodes()) to_.nodes.push_back(readPlainNode(node_));
    return true;
  }

  bool open(Json container) {
    const std::size_t depth = countOpen();
    to_.duplicates.seeStart(depth, container.is_array());
    if (depth == 1 && inNodes_ && !container.is_array()) {
      to_.hasWrongNodes = true;
      inNodes_ = false;
    }
    open_.push_back(place(std::move(container)));
    return true;
  }

  bool close() {
    open_.pop_back();
    if (isInListOfNodes()) to_.nodes.push_back(readPlainNode(node_));
    return true;
  }

  const std::filesystem::path& file_;
  ParsedGltf& to_;
  std::vector<Json*> open_;  ///< containers, from the outermost on; null: not kept
  std::string key_;          ///< the last one
  Json node_;                ///< the node that is being read
  bool inNodes_ = false;     ///< whether the list of nodes is being read
  bool isKept_ = false;      ///< whether the section that is being read is kept
};

}  // namespace

void failJson(const std::filesystem::path& file, const std::string& fault) {
  throw ImportError(file.string() + ": its JSON " + fault + "; export it again");
}

ParsedGltf parseGltf(const std::string& text, const std::filesystem::path& file) {
  ParsedGltf parsed;
  GltfHandler handler(file, parsed);
  Json::sax_parse(text, &handler);
  if (!parsed.sections.is_object()) failJson(file, "is not an object");
  return parsed;
}

}  // namespace enfilade::scene
