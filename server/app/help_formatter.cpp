#include "server/app/help_formatter.hpp"

namespace enfilade::server {

std::string formatValueName(std::string type) {
  const auto colon = type.find(':');
  if (colon != std::string::npos) type.erase(0, colon + 1);
  return type;
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
  if (option->get_type_size() == 0 || option->get_positional()) return "";
  std::string text = " " + formatValueName(option->get_type_name());
  if (option->get_expected_max() == CLI::detail::expected_max_vector_size) text += " ...";
  if (!option->get_default_str().empty()) text += " (" + option->get_default_str() + ")";
  if (option->get_required()) text += " (required)";
  return text;
}

}  // namespace enfilade::server
