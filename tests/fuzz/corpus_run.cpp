// Feeds every file of the given folders to a fuzz target, in builds without libFuzzer.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/fuzz/fuzz_target.hpp"

namespace {

std::vector<std::filesystem::path> listFilesIn(const char* folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.is_regular_file()) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::uint8_t> readBytes(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  std::vector<std::uint8_t> bytes;
  std::transform(std::istreambuf_iterator<char>(stream), {}, std::back_inserter(bytes),
                 [](char c) { return static_cast<std::uint8_t>(c); });
  return bytes;
}

}  // namespace

int main(int count, char** arguments) {
  std::size_t tried = 0;
  for (int i = 1; i < count; ++i) {
    for (const auto& file : listFilesIn(arguments[i])) {
      // Printed before the call, so that the last line names a crashing file.
      std::fprintf(stderr, "%s\n", file.c_str());
      enfilade::fuzz::tryBytes(readBytes(file));
      ++tried;
    }
  }
  std::printf("%zu inputs\n", tried);
  return tried == 0 ? 1 : 0;
}
