#include "scene/import/assimp/obj_text.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "scene/import/assembly/coordinates.hpp"

namespace enfilade::scene {
namespace {

/// Iterates over the lines of a text, without line ends.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : rest_(text) {}
  bool next(std::string_view& line) {
    if (rest_.empty()) return false;
    const std::size_t end = std::min(rest_.find('\n'), rest_.size());
    line = rest_.substr(0, end);
    rest_.remove_prefix(std::min(end + 1, rest_.size()));
    return true;
  }

 private:
  std::string_view rest_;
};

struct ObjVertex {
  std::array<double, 3> position{};
  std::string_view tail;  ///< weight or colour, with the preceding blank
};

/// Parses "v x y z ..."; false for every other line.
bool parseVertex(std::string_view line, ObjVertex& vertex) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos || line[begin] != 'v' || begin + 1 >= line.size()) {
    return false;
  }
  line.remove_prefix(begin + 1);
  if (line.front() != ' ' && line.front() != '\t') return false;
  for (double& coordinate : vertex.position) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t+"), line.size()));
    const auto read = std::from_chars(line.data(), line.data() + line.size(), coordinate);
    if (read.ec != std::errc() || !std::isfinite(coordinate)) return false;
    line.remove_prefix(static_cast<std::size_t>(read.ptr - line.data()));
  }
  vertex.tail = line;
  return true;
}

Vec3 computeMedianVertex(std::string_view text) {
  std::array<std::vector<double>, 3> coordinates;
  LineReader lines(text);
  std::string_view line;
  ObjVertex vertex;
  while (lines.next(line)) {
    if (!parseVertex(line, vertex)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(vertex.position[axis]);
  }
  Vec3 median = Vec3::Zero();
  if (coordinates[0].empty()) return median;
  for (std::size_t axis = 0; axis < 3; ++axis)
    median[static_cast<Eigen::Index>(axis)] = computeMedian(std::move(coordinates[axis]));
  return median;
}

void appendNumber(std::string& to, double value) {
  std::array<char, 32> digits;
  to += ' ';
  to.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

}  // namespace

RebasedText rebaseObj(const std::filesystem::path& file, double maxDistance) {
  std::ifstream in(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  RebasedText shifted;
  const Vec3 median = computeMedianVertex(text);
  if (!(median.norm() > maxDistance)) return shifted;
  shifted.shift = {std::round(median.x()), std::round(median.y()), std::round(median.z())};
  LineReader lines(text);
  std::string_view line;
  ObjVertex vertex;
  while (lines.next(line)) {
    if (parseVertex(line, vertex)) {
      shifted.text += 'v';
      for (std::size_t axis = 0; axis < 3; ++axis) {
        appendNumber(shifted.text,
                     vertex.position[axis] - shifted.shift[static_cast<Eigen::Index>(axis)]);
      }
      shifted.text += vertex.tail;
    } else {
      shifted.text += line;
    }
    shifted.text += '\n';
  }
  return shifted;
}

}  // namespace enfilade::scene
