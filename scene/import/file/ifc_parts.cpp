// Marks each statement with the parts whose shapes refer to it, by depth-first search from the
// shapes of the products. A statement that no product's shape refers to belongs to all parts, and
// so do the statements that it refers to. Statements about geometry that a reader finds from the
// geometry are excepted: styles of items, layers, types of products.
#include "scene/import/file/ifc_parts.hpp"

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <string_view>

#include "collision/assert.hpp"

namespace enfilade::scene {
namespace {

using PartMask = std::uint8_t;

/// Ids per statement, up to which a table by id takes less memory than the text.
constexpr std::size_t kMaxSparsity = 8;
constexpr std::size_t kMinGap = 4096;  // bytes; a shorter one is read, too: fewer ranges

/// Calls visit(id) for each reference outside of strings.
template <class Visit>
void visitReferences(std::string_view arguments, const Visit& visit) {
  const char* const end = arguments.data() + arguments.size();
  const auto visitAt = [&](std::size_t hash) {
    std::uint32_t id = 0;
    const auto number = std::from_chars(arguments.data() + hash + 1, end, id);
    if (number.ec == std::errc()) visit(id);
  };
  if (arguments.find('\'') == std::string_view::npos) {  // geometry has no strings
    for (std::size_t i = arguments.find('#'); i != std::string_view::npos;
         i = arguments.find('#', i + 1))
      visitAt(i);
    return;
  }
  bool quoted = false;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i] == '\'') quoted = !quoted;
    if (!quoted && arguments[i] == '#') visitAt(i);
  }
}

bool isProductShape(std::string_view type) {
  return type == "IFCPRODUCTDEFINITIONSHAPE" || type == "IFCPRODUCTREPRESENTATION";
}

/// Statements that only describe the shapes that they refer to.
bool isAboutShapes(std::string_view type) {
  return type == "IFCSHAPEASPECT" || type.starts_with("IFCPRESENTATIONLAYER");
}

/// Statements whose first argument is the item that they describe.
bool isAboutFirst(std::string_view type) {
  return type == "IFCSTYLEDITEM" || type == "IFCINDEXEDCOLOURMAP";
}

class IfcDivider {
 public:
  IfcDivider(const StepFile& file, const std::vector<std::uint32_t>& products, std::size_t count)
      : file_(file),
        products_(products),
        parts_(count),
        weights_(count),
        masks_(file.statements().size()),
        isProduct_(file.statements().size()) {
    std::uint32_t highest = 0;
    for (const StepStatement& statement : file.statements())
      highest = std::max(highest, statement.id);
    if (highest / kMaxSparsity > masks_.size()) return;
    indexById_.resize(std::size_t{highest} + 1, kNoStatement);
    for (std::size_t i = masks_.size(); i-- > 0;)  // of equal ids the first counts
      indexById_[file.statements()[i].id] = static_cast<std::uint32_t>(i);
  }

  std::vector<IfcFilePart> divide() {
    for (const std::uint32_t id : products_)
      if (const StepStatement* product = find(id)) isProduct_[getIndex(*product)] = true;
    for (const std::uint32_t id : products_) assign(id);
    isInShape_.resize(masks_.size());
    for (std::size_t i = 0; i < masks_.size(); ++i) isInShape_[i] = masks_[i] != 0;
    for (std::size_t i = 0; i < masks_.size(); ++i)
      if (!isInShape_[i]) keepReferences(file_.statements()[i]);
    for (std::size_t part = 0; part < parts_.size(); ++part) listRanges(part);
    return std::move(parts_);
  }

 private:
  const StepStatement* find(std::uint32_t id) const {
    if (indexById_.empty()) return file_.find(id);
    const std::uint32_t index = id < indexById_.size() ? indexById_[id] : kNoStatement;
    return index == kNoStatement ? nullptr : &file_.statements()[index];
  }

  std::size_t getIndex(const StepStatement& statement) const {
    return static_cast<std::size_t>(&statement - file_.statements().data());
  }

  std::size_t findLightest() const {
    return static_cast<std::size_t>(std::ranges::min_element(weights_) - weights_.begin());
  }

  void assign(std::uint32_t id) {
    const StepStatement* product = find(id);
    const StepStatement* shape = product == nullptr ? nullptr : findShape(*product);
    std::size_t part = findLightest();
    if (const auto map = shape == nullptr ? std::nullopt : findMap(*shape))
      part = partOfMap_.try_emplace(*map, part).first->second;
    parts_[part].products.push_back(id);
    if (shape != nullptr)
      weights_[part] += mark(getIndex(*shape), static_cast<PartMask>(1U << part));
  }

  const StepStatement* findShape(const StepStatement& product) const {
    const StepStatement* shape = nullptr;
    visitReferences(product.arguments, [&](std::uint32_t id) {
      const StepStatement* target = find(id);
      if (target != nullptr && isProductShape(target->type)) shape = target;
    });
    return shape;
  }

  /// The first IfcRepresentationMap of a shape: shape, representation, IfcMappedItem, map.
  std::optional<std::uint32_t> findMap(const StepStatement& from, int depth = 3) const {
    std::optional<std::uint32_t> map;
    visitReferences(from.arguments, [&](std::uint32_t id) {
      const StepStatement* target = map || depth == 0 ? nullptr : find(id);
      if (target == nullptr) return;
      if (target->type == "IFCREPRESENTATIONMAP") map = id;
      if (depth > 2 ? target->type == "IFCSHAPEREPRESENTATION" : target->type == "IFCMAPPEDITEM")
        map = findMap(*target, depth - 1);
    });
    return map;
  }

  /// Marks a statement and all that it refers to, except products. Returns the bytes that are
  /// marked for the first time.
  std::size_t mark(std::size_t statement, PartMask mask) {
    std::size_t bytes = 0;
    std::vector<std::size_t> open;
    const auto visit = [&](std::size_t index) {
      if (isProduct_[index] || (masks_[index] & mask) == mask) return;
      if (masks_[index] == 0) bytes += file_.statements()[index].arguments.size();
      masks_[index] |= mask;
      open.push_back(index);
    };
    visit(statement);
    while (!open.empty()) {
      const StepStatement& next = file_.statements()[open.back()];
      open.pop_back();
      visitReferences(next.arguments, [&](std::uint32_t id) {
        if (const StepStatement* target = find(id)) visit(getIndex(*target));
      });
    }
    return bytes;
  }

  /// Keeps in all parts what a statement outside of the shapes needs of them.
  void keepReferences(const StepStatement& from) {
    if (isAboutShapes(from.type)) return;
    const bool isWanted = isProduct_[getIndex(from)];
    bool skip = isAboutFirst(from.type) && from.arguments.starts_with('#');
    visitReferences(from.arguments, [&](std::uint32_t id) {
      const StepStatement* target = skip ? nullptr : find(id);
      skip = false;
      if (target == nullptr || !isInShape_[getIndex(*target)]) return;
      const bool isOwnShape = isWanted && isProductShape(target->type);
      if (isOwnShape || target->type == "IFCREPRESENTATIONMAP") return;
      mark(getIndex(*target), static_cast<PartMask>((1U << parts_.size()) - 1));
    });
  }

  /// The range of a statement in the text, with its semicolon.
  TextRange locate(const StepStatement& statement) const {
    const std::string_view text = file_.text();
    const auto type = static_cast<std::size_t>(statement.type.data() - text.data());
    const auto end = static_cast<std::size_t>(statement.arguments.data() - text.data()) +
                     statement.arguments.size();
    const std::size_t first = text.rfind('#', type);
    return {first, text.find(';', end) + 1 - first};
  }

  void listRanges(std::size_t part) {
    std::vector<TextRange>& ranges = parts_[part].ranges;
    std::uint64_t kept = 0;  // where the present range begins
    for (std::size_t i = 0; i < masks_.size();) {
      if (masks_[i] == 0 || (masks_[i] >> part & 1) != 0) {
        ++i;
        continue;
      }
      const TextRange first = locate(file_.statements()[i]);
      TextRange last = first;
      for (; i < masks_.size() && masks_[i] != 0 && (masks_[i] >> part & 1) == 0; ++i)
        last = locate(file_.statements()[i]);
      const std::uint64_t end = last.first + last.size;
      if (end - first.first < kMinGap) continue;
      if (first.first > kept) ranges.push_back({kept, first.first - kept});
      kept = end;
    }
    if (file_.text().size() > kept) ranges.push_back({kept, file_.text().size() - kept});
  }

  static constexpr std::uint32_t kNoStatement = 0xffffffff;

  const StepFile& file_;
  const std::vector<std::uint32_t>& products_;
  std::vector<IfcFilePart> parts_;
  std::vector<std::size_t> weights_;      // by part: bytes
  std::vector<PartMask> masks_;           // by statement: the parts whose shapes refer to it
  std::vector<std::uint32_t> indexById_;  // empty: the ids are too sparse for it
  std::vector<bool> isProduct_, isInShape_;
  std::map<std::uint32_t, std::size_t> partOfMap_;
};

}  // namespace

std::vector<IfcFilePart> divideIfc(const StepFile& file, const std::vector<std::uint32_t>& products,
                                   std::size_t count) {
  ENFILADE_ASSERT(count > 0 && count <= 8);  // bits of a PartMask
  std::vector<IfcFilePart> parts = IfcDivider(file, products, count).divide();
  if (std::ranges::any_of(parts, [](const IfcFilePart& part) { return part.products.empty(); }))
    parts.clear();
  return parts;
}

}  // namespace enfilade::scene
