#include "protocol/script/line_error.hpp"

namespace enfilade::protocol {

void refuse(std::string_view field, const std::string& text) {
  throw LineError{field.empty() ? text : std::string(field) + ": " + text};
}

}  // namespace enfilade::protocol
