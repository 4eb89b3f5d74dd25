// OBJ files with coordinates on a map: assimp reads vertices into floats, so what they share is
// taken off the text before, in doubles.
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <string_view>

#include "scene/import/assimp/convert_scene.hpp"

namespace enfilade::scene {
namespace {

/// The lines of `text`, one after the other, without their ends.
class Lines {
 public:
  explicit Lines(std::string_view text) : rest_(text) {}
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

struct Vertex {
  std::array<double, 3> at{};
  std::string_view tail;  ///< weight or colour, with the blank before it
};

/// "v x y z ..."; false for every other line.
bool readVertex(std::string_view line, Vertex& vertex) {
  const std::size_t begin = line.find_first_not_of(" \t");
  if (begin == std::string_view::npos || line[begin] != 'v' || begin + 1 >= line.size()) {
    return false;
  }
  line.remove_prefix(begin + 1);
  if (line.front() != ' ' && line.front() != '\t') return false;
  for (double& coordinate : vertex.at) {
    line.remove_prefix(std::min(line.find_first_not_of(" \t+"), line.size()));
    const auto read = std::from_chars(line.data(), line.data() + line.size(), coordinate);
    if (read.ec != std::errc() || !std::isfinite(coordinate)) return false;
    line.remove_prefix(static_cast<std::size_t>(read.ptr - line.data()));
  }
  vertex.tail = line;
  return true;
}

Vec3 medianVertex(std::string_view text) {
  std::array<std::vector<double>, 3> coordinates;
  Lines lines(text);
  std::string_view line;
  Vertex vertex;
  while (lines.next(line)) {
    if (!readVertex(line, vertex)) continue;
    for (std::size_t axis = 0; axis < 3; ++axis) coordinates[axis].push_back(vertex.at[axis]);
  }
  Vec3 median = Vec3::Zero();
  for (std::size_t axis = 0; axis < 3 && !coordinates[0].empty(); ++axis) {
    const auto middle =
        coordinates[axis].begin() + static_cast<std::ptrdiff_t>(coordinates[axis].size() / 2);
    std::nth_element(coordinates[axis].begin(), middle, coordinates[axis].end());
    median[static_cast<Eigen::Index>(axis)] = *middle;
  }
  return median;
}

void appendNumber(std::string& to, double value) {
  std::array<char, 32> digits;
  to += ' ';
  to.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
}

}  // namespace

ShiftedText shiftedObj(const std::filesystem::path& file, double farAway) {
  std::ifstream in(file, std::ios::binary);
  const std::string text((std::istreambuf_iterator<char>(in)), {});
  ShiftedText shifted;
  const Vec3 median = medianVertex(text);
  if (!(median.norm() > farAway)) return shifted;
  shifted.shift = {std::round(median.x()), std::round(median.y()), std::round(median.z())};
  Lines lines(text);
  std::string_view line;
  Vertex vertex;
  while (lines.next(line)) {
    if (readVertex(line, vertex)) {
      shifted.text += 'v';
      for (std::size_t axis = 0; axis < 3; ++axis) {
        appendNumber(shifted.text,
                     vertex.at[axis] - shifted.shift[static_cast<Eigen::Index>(axis)]);
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
