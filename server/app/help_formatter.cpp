#include "server/app/help_formatter.hpp"

namespace enfilade::server {
namespace {

/// "TEXT:HOST:PORT" -> "HOST:PORT"; "TEXT:{x,y,z}" -> "x|y|z"; "TEXT" -> "TEXT".
std::string formatValueName(std::string type) {
  const auto colon = type.find(':');
  if (colon != std::string::npos) type.erase(0, colon + 1);
  if (type.front() != '{' || type.back() != '}') return type;
  type = type.substr(1, type.size() - 2);
  std::replace(type.begin(), type.end(), ',', '|');
  return type;
}

}  // namespace

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0 || option->get_positional()) return "";
  std::string text = " " + formatValueName(option->get_type_name());
  if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
  if (!option->get_default_str().empty()) text += " (" + option->get_default_str() + ")";
  return text;
}

}  // namespace enfilade::server
