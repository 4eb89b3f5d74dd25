// Fixture of tests of the program `enfilade capture` in the small room, and readers of its output.
#pragma once

#include <cstdlib>
#include <cstring>
#include <map>

#include "render/gl/gl_renderer.hpp"
#include "tests/server/program_fixture.hpp"
#include "tests/server/small_room.hpp"

namespace enfilade::server::testing {

namespace fs = std::filesystem;
using nlohmann::json;

/// An array of a .npy file, as stored.
template <class Value>
struct Array {
  int height = 0, width = 0;
  std::vector<Value> values;

  const Value& at(int x, int y) const {
    return values.at(static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                     static_cast<std::size_t>(x));
  }
};

template <class Value>
Array<Value> readNpy(const fs::path& file) {
  const std::string bytes = readText(file);
  Array<Value> array;
  const std::size_t shape = bytes.find("'shape': (");
  if (shape == std::string::npos) return array;
  std::sscanf(bytes.c_str() + shape, "'shape': (%d, %d", &array.height, &array.width);
  const std::size_t start = bytes.find('\n') + 1;
  array.values.resize((bytes.size() - start) / sizeof(Value));
  std::memcpy(array.values.data(), bytes.data() + start, bytes.size() - start);
  return array;
}

/// Content of every file below the folder, by name.
inline std::map<std::string, std::string> readTree(const fs::path& folder) {
  std::map<std::string, std::string> tree;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file())
      tree[entry.path().lexically_relative(folder).generic_string()] = readText(entry.path());
  }
  return tree;
}

inline std::vector<std::string> getNames(const std::map<std::string, std::string>& tree) {
  std::vector<std::string> names;
  for (const auto& [name, text] : tree) names.push_back(name);
  return names;
}

inline bool canHavePictures() {
  static const bool can = [] {
    try {
      render::GlRenderer renderer(makeSmallRoom());
      return true;
    } catch (const render::RenderError&) {
      return false;
    }
  }();
  return can;
}

/// A path of `poses` poses along +x from x = 0, 0.2 m apart, at eye height, looking along +x; 30 a
/// second.
inline std::string makePathAhead(int poses) {
  std::ostringstream text;
  for (int i = 0; i < poses; ++i)
    text << i / 30.0 << " " << 0.2 * i << " 1.6 0 0 -0.7071067811865476 0 0.7071067811865476\n";
  return text.str();
}

class Capture : public ProgramFixture {
 protected:
  void SetUp() override {
    if (!canHavePictures()) {
      ASSERT_EQ(std::getenv("CI"), nullptr) << "no EGL device: install libegl-mesa0";
      GTEST_SKIP() << "no EGL device: install libegl-mesa0";
    }
    ProgramFixture::SetUp();
  }

  Ended runCapture(const std::string& pathFile, const std::string& out,
                   std::vector<std::string> options = {}) const {
    std::vector<std::string> arguments{"capture", getPath("room.obj"), getPath(pathFile), "--out",
                                       getPath(out)};
    if (!film_) options.push_back("--no-mp4");
    if (std::find(options.begin(), options.end(), "--size") == options.end())
      options.insert(options.end(), {"--size", "64x48"});
    arguments.insert(arguments.end(), options.begin(), options.end());
    return run(arguments);
  }

  bool film_ = false;  ///< whether ffmpeg is available
};

}  // namespace enfilade::server::testing
