#include "assets/maker.hpp"

#include <charconv>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string_view>

namespace enfilade::assets {
namespace {

std::uint64_t parseNumber(std::string_view text) {
  std::uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc{} || end != text.data() + text.size())
    throw std::invalid_argument("'" + std::string(text) + "' is not a whole number");
  return number;
}

MakerArguments parseArguments(std::span<const char* const> texts) {
  if (texts.empty() || texts.size() > 3) throw std::invalid_argument("1 to 3 arguments wanted");
  MakerArguments arguments;
  arguments.file = texts[0];
  if (arguments.file.starts_with('-'))
    throw std::invalid_argument("unknown option '" + arguments.file + "'");
  if (texts.size() > 1) arguments.number = parseNumber(texts[1]);
  if (texts.size() > 2) arguments.seed = parseNumber(texts[2]);
  return arguments;
}

}  // namespace

int runMaker(int argc, const char* const* argv, const char* usage,
             const std::function<void(const MakerArguments&)>& make) {
  const std::span<const char* const> texts(argv + 1, static_cast<std::size_t>(argc - 1));
  if (texts.size() == 1 && texts[0] == std::string_view("--help")) {
    std::printf("%s\n", usage);
    return 0;
  }
  try {
    make(parseArguments(texts));
    return 0;
  } catch (const std::invalid_argument& error) {
    std::fprintf(stderr, "%s: %s\n%s\n", argv[0], error.what(), usage);
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: %s\n", argv[0], error.what());
    return 1;
  }
}

}  // namespace enfilade::assets
