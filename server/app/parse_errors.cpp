#include "server/app/parse_errors.hpp"

#include <array>
#include <cctype>
#include <optional>
#include <utility>
#include <vector>

#include "protocol/nearest_word.hpp"
#include "server/app/help_formatter.hpp"

namespace enfilade::server {
namespace {

/// Options of other programs, with what is closest here.
constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kSynonyms{
    {{"--port", "--listen"},
     {"--host", "--listen"},
     {"--address", "--connect"},
     {"--output", "--out"},
     {"--resolution", "--size"},
     {"--width", "--size"}}};

std::vector<std::string> listOptions(const CLI::App& verb) {
  std::vector<std::string> names;
  for (const CLI::Option* option : verb.get_options())
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  return names;
}

std::string suggestOption(const CLI::App& verb, const std::string& typed) {
  for (const auto& [other, ours] : kSynonyms)
    if (typed == other && verb.get_option_no_throw(std::string(ours)) != nullptr)
      return std::string(ours);
  return protocol::findNearestWord(typed, listOptions(verb));
}

/// Describes the first argument that the command does not know, options first.
std::optional<std::string> describeUnknownArgument(const CLI::App& verb) {
  const std::vector<std::string> unknown = verb.remaining();
  for (const std::string& argument : unknown) {
    if (!argument.starts_with("--")) continue;
    const std::string typed = argument.substr(0, argument.find('='));
    const std::string nearest = suggestOption(verb, typed);
    return "unknown option '" + typed + "'" +
           (nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
  }
  if (unknown.empty()) return std::nullopt;
  return "unexpected argument '" + unknown.front() + "'; leave it out";
}

/// The option whose name starts the text of the error; null without one.
const CLI::Option* findOption(const CLI::App& verb, const std::string& text) {
  return verb.get_option_no_throw(text.substr(0, text.find_first_of(": ")));
}

std::string describeMissing(const CLI::Option& option) {
  std::string description = option.get_description();
  description.front() = static_cast<char>(std::tolower(description.front()));
  return option.get_name() + " is required: " + description;
}

}  // namespace

std::string describeParseError(const CLI::App& verb, const CLI::ParseError& error) {
  if (auto unknown = describeUnknownArgument(verb)) return *unknown;
  const std::string text = error.what();
  const CLI::Option* option = findOption(verb, text);
  if (option == nullptr) return text;
  if (error.get_name() == "RequiredError") return describeMissing(*option);
  if (error.get_name() == "ArgumentMismatch" && option->get_type_size() != 0)
    return option->get_name() + ": give " + formatValueName(option->get_type_name());
  return text;
}

}  // namespace enfilade::server
