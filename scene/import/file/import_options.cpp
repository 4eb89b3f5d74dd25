#include "scene/import/file/import_options.hpp"

#include <charconv>
#include <cmath>
#include <map>

namespace enfilade::scene {
namespace {

constexpr std::size_t kTextMemoryDivisor = 8;  // the text may take 1/8 of the memory limit
constexpr std::size_t kMaxTextBytes = std::size_t{4} << 30;  // bytes, without a memory limit

}  // namespace

std::size_t computeMaxTextBytes(const ImportOptions& options) {
  return options.memoryLimit > 0 ? options.memoryLimit / kTextMemoryDivisor : kMaxTextBytes;
}

std::optional<IfcReader> parseIfcReader(const std::string& text) {
  static const std::map<std::string, IfcReader> kReaders{{"auto", IfcReader::automatic},
                                                         {"web-ifc", IfcReader::webIfc},
                                                         {"ifcplusplus", IfcReader::ifcPlusPlus},
                                                         {"assimp", IfcReader::assimp}};
  const auto reader = kReaders.find(text);
  return reader == kReaders.end() ? std::nullopt : std::optional(reader->second);
}

std::optional<double> parseMetresPerUnit(const std::string& text) {
  static const std::map<std::string, double> kUnits{
      {"m", 1}, {"mm", 0.001}, {"cm", 0.01}, {"ft", 0.3048}, {"in", 0.0254}};
  if (const auto unit = kUnits.find(text); unit != kUnits.end()) return unit->second;
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || !(value > 0) || !std::isfinite(value)) return std::nullopt;
  return value;
}

}  // namespace enfilade::scene
