#include "protocol/unknown_enums.hpp"

#include <google/protobuf/descriptor.h>
#include <google/protobuf/message.h>

#include <map>
#include <vector>

namespace enfilade::protocol {
namespace {

namespace pb = google::protobuf;
using Descriptor = pb::Descriptor;
using Field = pb::FieldDescriptor;

/// Whether messages of a type can hold enums, at any depth: most cannot, and are not searched.
class EnumHolders {
 public:
  bool holds(const Descriptor& type) {
    const auto [known, isNew] = holds_.try_emplace(&type, false);  // false: ends recursion
    if (!isNew) return known->second;
    bool found = false;
    for (int i = 0; i < type.field_count() && !found; ++i) {
      const Field& field = *type.field(i);
      found = field.cpp_type() == Field::CPPTYPE_ENUM ||
              (field.cpp_type() == Field::CPPTYPE_MESSAGE && holds(*field.message_type()));
    }
    return holds_[&type] = found;
  }

 private:
  std::map<const Descriptor*, bool> holds_;
};

bool isKnown(const Field& field, int value) {
  return field.enum_type()->FindValueByNumber(value) != nullptr;
}

std::string formatIndex(const Field& field, int index) {
  return field.is_repeated() ? field.name() + "[" + std::to_string(index) + "]" : field.name();
}

std::string search(const pb::Message& message, EnumHolders& holders);

std::string searchField(const pb::Message& message, const Field& field, EnumHolders& holders) {
  const pb::Reflection& read = *message.GetReflection();
  const bool repeated = field.is_repeated();
  const bool isEnum = field.cpp_type() == Field::CPPTYPE_ENUM;
  const bool isMessage = field.cpp_type() == Field::CPPTYPE_MESSAGE;
  if (!isEnum && !(isMessage && holders.holds(*field.message_type()))) return {};
  const int count = repeated ? read.FieldSize(message, &field) : 1;
  for (int i = 0; i < count; ++i) {
    if (isEnum) {
      const int value = repeated ? read.GetRepeatedEnumValue(message, &field, i)
                                 : read.GetEnumValue(message, &field);
      if (!isKnown(field, value)) return formatIndex(field, i) + " = " + std::to_string(value);
      continue;
    }
    const std::string inner = search(
        repeated ? read.GetRepeatedMessage(message, &field, i) : read.GetMessage(message, &field),
        holders);
    if (!inner.empty()) return formatIndex(field, i) + "." + inner;
  }
  return {};
}

std::string search(const pb::Message& message, EnumHolders& holders) {
  std::vector<const Field*> present;
  message.GetReflection()->ListFields(message, &present);
  for (const Field* field : present) {
    std::string found = searchField(message, *field, holders);
    if (!found.empty()) return found;
  }
  return {};
}

}  // namespace

std::string findUnknownEnum(const pb::Message& message) {
  thread_local EnumHolders holders;
  if (!holders.holds(*message.GetDescriptor())) return {};
  return search(message, holders);
}

}  // namespace enfilade::protocol
