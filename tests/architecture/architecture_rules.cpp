#include "tests/architecture/architecture_rules.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <optional>
#include <regex>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

namespace enfilade::architecture {
namespace {

using Names = std::set<std::string>;

/// Folders that a folder may include in addition to itself.
const std::map<std::string, Names> kMayInclude{
    {"collision", {}},
    {"scene", {"collision"}},
    {"render", {"collision", "scene"}},
    {"protocol", {}},
    {"server", {"collision", "scene", "render", "protocol"}},
    {"assets", {"collision", "scene"}},
    {"examples", {"collision", "protocol"}},
};

/// The rooms, bottom up: a file includes its own room and rooms above it in this list, never one
/// below it.
const std::vector<std::string> kRooms{
    "collision",
    "collision/shapes",
    "collision/bounds",
    "collision/broad_phase",
    "collision/minkowski",
    "collision/exact",
    "collision/narrow_phase",
    "collision/compound",
    "collision/motion",
    "scene/base",
    "scene/model",
    "scene/model/shapes",
    "scene/import/file",
    "scene/import/assembly",
    "scene/import/worker",
    "scene/import/gltf/encoding",
    "scene/import/gltf",
    "scene/import/scan",
    "scene/import/bodies",
    "scene/import/assimp",
    "scene/import/ifc",
    "scene/import",
    "scene/import/cache",
    "scene/physics",
    "scene/world/data",
    "scene/world/queries",
    "scene/world/contacts",
    "scene/world/bodies",
    "scene/world/avatars",
    "scene/world",
    "scene/world/checkpoint",
    "scene/navigation/mesh",
    "scene/navigation/walk",
    "scene/navigation",
    "render/camera",
    "render",
    "render/image",
    "render/culling",
    "render/gl",
    "render/raytrace",
    "render/reference",
    "render/service",
    "protocol",
    "protocol/mcap",
    "protocol/recording",
    "protocol/script",
    "protocol/clients/cpp",
    "server/log",
    "server/base",
    "server/export",
    "server/messages",
    "server/floors",
    "server/recording/foxglove",
    "server/recording",
    "server/navigation",
    "server/hosting",
    "server/hosting/requests",
    "server/worlds",
    "server/net",
    "server/plans",
    "server/runs",
    "server/capture/path",
    "server/capture",
    "server/inspection",
    "server/commands",
    "server/diff",
    "server/app",
};

/// Folders without rooms: nothing includes them but themselves and the tests.
const Names kWithoutRooms{"assets", "examples", "tests"};

struct ThirdParty {
  const char* name;
  const char* pattern;  ///< of what stands between the brackets of the include
  Names folders;        ///< where it may be used: folders, or rooms with those below
};

const std::array<ThirdParty, 23> kThirdParties{{
    {"GMP", "gmp.*", {"collision"}},
    {"assimp", "assimp/.*", {"scene"}},
    {"ifcplusplus", "(ifcpp|carve)/.*", {"scene"}},
    {"Recast and Detour", "(Recast|Detour).*", {"scene"}},
    {"Embree", "embree.*", {"scene", "render"}},
    {"EGL and OpenGL", "(epoxy|EGL|GL|GLES.*)/.*", {"render"}},
    {"libpng", "png.*", {"scene", "render"}},
    {"libjpeg", "(jpeglib|turbojpeg).*", {"scene", "render"}},
    {"WebP", "webp/.*", {"scene"}},
    {"Draco", "draco/.*", {"scene"}},
    {"meshoptimizer", "meshoptimizer.*", {"scene"}},
    {"Cairo and Pango", "(cairo.*|pango/.*)", {"render"}},
    {"minizip", "minizip/.*", {"scene"}},
    {"xxHash", "xxh.*", {"scene"}},
    {"zlib", "zlib.*", {"protocol", "server"}},
    {"zstd", "zstd.*", {"protocol", "render", "server"}},
    {"Boost.Asio and Beast", "boost/(asio|beast|system).*", {"server/net"}},
    {"other Boost", "boost/(?!asio|beast|system).*", {}},
    {"protobuf", "google/protobuf/.*", {"protocol"}},
    {"nlohmann-json", "nlohmann/.*", {"scene", "render", "protocol", "server", "assets"}},
    {"CLI11", "CLI/.*", {"server/app"}},
    {"spdlog", "spdlog/.*", {"server/log", "server/app"}},
    {"fmt", "fmt/.*", {"server"}},
}};

struct Include {
  int line = 0;
  bool quoted = false;
  std::string path;
};

std::string getFolder(const std::string& path) {
  const auto slash = path.find('/');
  return slash == std::string::npos ? std::string() : path.substr(0, slash);
}

/// "scene/import/ifc" of "scene/import/ifc/units.hpp".
std::string getRoom(const std::string& path) {
  const auto slash = path.rfind('/');
  return slash == std::string::npos ? std::string() : path.substr(0, slash);
}

bool endsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

bool isHeader(const std::string& path) {
  return endsWith(path, ".hpp");
}
bool isCode(const std::string& path) {
  return isHeader(path) || endsWith(path, ".cpp");
}
bool isScript(const std::string& path) {
  return endsWith(path, ".ts") || endsWith(path, ".js") || endsWith(path, ".mjs");
}
bool isGeneratedMessage(const std::string& path) {
  return endsWith(path, ".pb.h");
}

std::string formatPlace(const std::string& path, int line) {
  return path + ":" + std::to_string(line);
}

/// Calls `see(line number, line)` for each line of `text`.
template <typename See>
void forEachLine(const std::string& text, const See& see) {
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) see(number, line);
}

std::vector<Include> findIncludes(const std::string& text) {
  static const std::regex include(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");
  std::vector<Include> found;
  forEachLine(text, [&](int number, const std::string& line) {
    std::smatch match;
    if (std::regex_search(line, match, include))
      found.push_back({number, match[1] == "\"", match[2]});
  });
  return found;
}

/// Headers that `open` includes, and all that these include in turn; with `withSources`, that the
/// sources of these headers include, too.
Names findReachedHeaders(const Sources& sources, std::vector<std::string> open, bool withSources) {
  Names reached;
  while (!open.empty()) {
    const std::string path = open.back();
    open.pop_back();
    for (const Include& include : findIncludes(sources.at(path))) {
      if (!include.quoted || sources.count(include.path) == 0) continue;
      if (!reached.insert(include.path).second) continue;
      open.push_back(include.path);
      const std::string source = include.path.substr(0, include.path.rfind('.')) + ".cpp";
      if (withSources && sources.count(source) != 0) open.push_back(source);
    }
  }
  return reached;
}

/// Headers of a folder that code of another one includes, and all that these include in turn.
Names findPublicHeaders(const Sources& sources) {
  Names reached;
  std::vector<std::string> open;
  for (const auto& [path, text] : sources) {
    if (!isCode(path) || kMayInclude.count(getFolder(path)) == 0) continue;
    for (const Include& include : findIncludes(text))
      if (include.quoted && getFolder(include.path) != getFolder(path) &&
          sources.count(include.path) != 0 && reached.insert(include.path).second)
        open.push_back(include.path);
  }
  reached.merge(findReachedHeaders(sources, std::move(open), false));
  return reached;
}

bool isAllowedInPublicHeader(const std::string& path) {
  const bool standard = path.find_first_of("/.") == std::string::npos;
  return standard || path.rfind("Eigen/", 0) == 0 || isGeneratedMessage(path);
}

std::optional<std::string> findFaultOfInclude(const Sources& sources, const std::string& from,
                                              const Include& include) {
  const std::string folder = getFolder(from);
  const std::string target = getFolder(include.path);
  if (target.empty()) return "\"" + include.path + "\" is not a path from the root";
  if (sources.count(include.path) == 0 && !isGeneratedMessage(include.path))
    return "\"" + include.path + "\" is not in the repository";
  if (folder == "tests") return std::nullopt;
  if (folder == target) return std::nullopt;
  const auto allowed = kMayInclude.find(folder);
  if (allowed == kMayInclude.end())
    return folder + "/ is no folder that the include rules know; add it to kMayInclude";
  if (allowed->second.count(target) == 0) return folder + "/ may not include " + target + "/";
  return std::nullopt;
}

std::optional<std::string> findFaultBetweenRooms(const std::string& from, const Include& include) {
  const std::string room = getRoom(from), wanted = getRoom(include.path);
  if (room == wanted || kWithoutRooms.count(getFolder(from)) != 0 ||
      isGeneratedMessage(include.path))
    return std::nullopt;
  const auto here = std::find(kRooms.begin(), kRooms.end(), room);
  if (here == kRooms.end()) return room + "/ is not a known room; add it to kRooms";
  if (std::find(kRooms.begin(), here, wanted) == here)
    return room + "/ may not include " + wanted + "/, which is above it";
  return std::nullopt;
}

bool isSkippedFolder(const std::string& name) {
  return name == ".git" || name == "out" || name == "node_modules" || name == ".cache" ||
         name.rfind("build", 0) == 0;
}

bool isWrittenByPeople(const std::filesystem::path& file) {
  static const Names endings{".cpp",  ".hpp",   ".inc", ".proto", ".txt", ".cmake", ".md",
                             ".json", ".jsonl", ".py",  ".js",    ".mjs", ".ts"};
  static const Names names{"dev", "run", ".gitignore", ".clang-format"};
  if (file.filename() == "package-lock.json" || file.parent_path().filename() == "generated")
    return false;
  return endings.count(file.extension().string()) != 0 ||
         names.count(file.filename().string()) != 0;
}

/// Dashes and signs are no words.
bool isWord(const std::string& text) {
  return std::any_of(text.begin(), text.end(),
                     [](unsigned char c) { return std::isalnum(c) != 0; });
}

/// A full stop ends a sentence, also before brackets, quotes and stars.
bool endsSentence(const std::string& word) {
  const auto last = word.find_last_not_of(")]*_`\"'");
  return last != std::string::npos && std::string(".!?").find(word[last]) != std::string::npos;
}

bool isOnlyLinkedTo(const std::filesystem::path& file) {
  const std::string extension = file.extension().string();
  return extension == ".png" || extension == ".svg" || file.filename() == "LICENSE";
}

}  // namespace

Sources readSources(const std::filesystem::path& root) {
  Sources sources;
  for (auto entry = std::filesystem::recursive_directory_iterator(root);
       entry != std::filesystem::recursive_directory_iterator(); ++entry) {
    if (entry->is_directory() && isSkippedFolder(entry->path().filename().string())) {
      entry.disable_recursion_pending();
      continue;
    }
    if (!entry->is_regular_file()) continue;
    const std::string path = entry->path().lexically_relative(root).generic_string();
    if (isOnlyLinkedTo(entry->path())) sources[path] = "";
    if (!isWrittenByPeople(entry->path())) continue;
    std::ifstream file(entry->path(), std::ios::binary);
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw std::runtime_error(entry->path().string() + ": cannot be read");
    sources[path] = text.str();
  }
  return sources;
}

Faults findWrongIncludes(const Sources& sources) {
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (!isCode(path)) continue;
    for (const Include& include : findIncludes(text)) {
      if (!include.quoted) continue;
      auto fault = findFaultOfInclude(sources, path, include);
      if (!fault) fault = findFaultBetweenRooms(path, include);
      if (fault) faults.push_back(formatPlace(path, include.line) + ": " + *fault);
    }
  }
  return faults;
}

Faults findIncludeRings(const Sources& sources) {
  const auto getModule = [](const std::string& path) { return path.substr(0, path.rfind('.')); };
  std::map<std::string, Names> included;  // by module; without modules that include no other one
  for (const auto& [path, text] : sources) {
    if (!isCode(path) || getFolder(path) == "tests") continue;
    for (const Include& include : findIncludes(text))
      if (sources.count(include.path) != 0 && getModule(include.path) != getModule(path))
        included[getModule(path)].insert(getModule(include.path));
  }
  for (std::size_t before = 0; before != included.size();) {
    before = included.size();
    std::erase_if(included, [&](const auto& module) {
      return std::ranges::none_of(module.second,
                                  [&](const auto& name) { return included.count(name) != 0; });
    });
  }
  if (included.empty()) return {};
  // Each remaining module includes another one: following includes ends in a ring.
  std::vector<std::string> ring{included.begin()->first};
  while (std::count(ring.begin(), ring.end(), ring.back()) == 1)
    ring.push_back(*std::ranges::find_if(
        included.at(ring.back()), [&](const auto& name) { return included.count(name) != 0; }));
  std::string fault;
  for (auto at = std::find(ring.begin(), ring.end(), ring.back()); at != ring.end(); ++at)
    fault += (fault.empty() ? "" : " -> ") + *at;
  return {fault};
}

Faults findPublicThirdParties(const Sources& sources) {
  Faults faults;
  for (const std::string& path : findPublicHeaders(sources)) {
    if (!isHeader(path)) continue;
    for (const Include& include : findIncludes(sources.at(path)))
      if (!include.quoted && !isAllowedInPublicHeader(include.path))
        faults.push_back(formatPlace(path, include.line) + ": <" + include.path +
                         "> in a header that other folders reach; move it into a .cpp file");
  }
  return faults;
}

Faults findMisplacedThirdParties(const Sources& sources) {
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (!isCode(path) || kMayInclude.count(getFolder(path)) == 0) continue;
    for (const Include& include : findIncludes(text)) {
      for (const ThirdParty& party : kThirdParties) {
        const auto contains = [&, &file = path](const std::string& folder) {
          return file.rfind(folder + "/", 0) == 0;
        };
        if (include.quoted || std::ranges::any_of(party.folders, contains)) continue;
        if (std::regex_match(include.path, std::regex(party.pattern)))
          faults.push_back(formatPlace(path, include.line) + ": " + party.name +
                           " has no place in " + getRoom(path) + "/");
      }
    }
  }
  return faults;
}

Faults findUndescribedRooms(const Sources& sources) {
  const auto page = sources.find("ARCHITECTURE.md");
  const std::string text = page == sources.end() ? "" : page->second;
  const auto headingNames = [&](const std::string& room) {
    static const std::regex heading("^## .*");
    bool named = false;
    forEachLine(text, [&](int, const std::string& line) {
      named |= std::regex_match(line, heading) && (line + " ").find(" " + room + " ") != line.npos;
    });
    return named;
  };
  Faults faults;
  for (const std::string& room : kRooms) {
    bool described = headingNames(room);
    for (auto slash = room.find('/'); slash != room.npos; slash = room.find('/', slash + 1))
      described |= text.find("`" + room.substr(slash + 1) + "/`") != text.npos;
    described |= text.find("`" + room + "/`") != text.npos;
    if (!described) faults.push_back(room + "/ is not in ARCHITECTURE.md; describe it there");
  }
  return faults;
}

Faults findHeadersWithoutPragmaOnce(const Sources& sources) {
  Faults faults;
  for (const auto& [path, text] : sources)
    if (isHeader(path) && text.find("#pragma once\n") == std::string::npos)
      faults.push_back(path + ": no #pragma once");
  return faults;
}

Faults findHeadersWithoutComment(const Sources& sources) {
  Faults faults;
  for (const auto& [path, text] : sources)
    if (endsWith(path, ".hpp") && kMayInclude.count(getFolder(path)) != 0 &&
        text.rfind("//", 0) != 0)
      faults.push_back(path + ": does not begin with a comment that says what it is");
  return faults;
}

Faults findLongFiles(const Sources& sources, int maxOfProduct, int maxOfOthers) {
  constexpr int kMaxSchemaLines = 1450;
  Faults faults;
  for (const auto& [path, text] : sources) {
    const bool isProduct =
        getFolder(path) != "tests" && (isCode(path) || isScript(path) || endsWith(path, ".py"));
    const bool isSchema = endsWith(path, ".proto");  // one document, compiled as a whole
    const int limit = isProduct ? maxOfProduct : isSchema ? kMaxSchemaLines : maxOfOthers;
    const auto lines = std::count(text.begin(), text.end(), '\n');
    if (lines > limit) faults.push_back(path + ": " + std::to_string(lines) + " lines");
  }
  return faults;
}

Faults findUnfinishedWork(const Sources& sources) {
  // Put together here, so that this file does not accuse itself.
  static const std::regex words(std::string("\\b(TO") + "DO|FIX" + "ME|X" + "XX)\\b");
  Faults faults;
  for (const auto& [path, text] : sources)
    forEachLine(text, [&, &name = path](int number, const std::string& line) {
      if (std::regex_search(line, words)) faults.push_back(formatPlace(name, number) + ": " + line);
    });
  return faults;
}

Faults findSourcesWithoutHeader(const Sources& sources) {
  static const std::regex alone(R"(main\.cpp|make_\w+\.cpp|\w+_module\.cpp|\w+_sanitizer\.cpp)");
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (!endsWith(path, ".cpp") || kMayInclude.count(getFolder(path)) == 0) continue;
    const auto slash = path.rfind('/');
    if (kWithoutRooms.count(getFolder(path)) != 0 ||
        std::regex_match(path.substr(slash + 1), alone))
      continue;
    if (sources.count(path.substr(0, path.size() - 4) + ".hpp") == 0)
      faults.push_back(path + ": no header of the same name");
  }
  return faults;
}

Faults findUnreachedHeaders(const Sources& sources) {
  std::vector<std::string> product;
  for (const auto& [path, text] : sources)
    if (isCode(path) && getFolder(path) != "collision" && getFolder(path) != "tests")
      product.push_back(path);
  const Names reached = findReachedHeaders(sources, std::move(product), true);
  Faults faults;
  for (const auto& [path, text] : sources)
    if (isHeader(path) && getFolder(path) == "collision" && reached.count(path) == 0)
      faults.push_back(path + ": the product does not use it; use it or delete it");
  return faults;
}

Faults findCrowdedFolders(const Sources& sources, int maxFiles) {
  std::map<std::string, int> counts;
  for (const auto& [path, text] : sources)
    if (endsWith(path, ".ts") || endsWith(path, ".py") ||
        (isCode(path) && kMayInclude.count(getFolder(path)) != 0 && getFolder(path) != "assets"))
      ++counts[getRoom(path)];
  Faults faults;
  for (const auto& [room, count] : counts)
    if (count > maxFiles) faults.push_back(room + "/: " + std::to_string(count) + " sources");
  return faults;
}

Faults findOddWords(const Sources& sources) {
  static const std::regex words(
      "\\b([Tt]old|[Tt]ells|[Aa]new|[Ll]est|[Bb]esides?|[Ss]omebody|[Nn]obody|[Ww]hoever|[Tt]"
      "hereof|"
      "has the say|goes on|stands for|is none|[Tt]win|[Mm]ended|[Nn]earness|textOf|"
      "(Mover|Wish|Follower|RigidStage|Hollows|HttpVisit|ServedWorld|Trial)s?|k(Most|Least|"
      "Few)[A-Z]\\w*|"
      "k(Farthest|Largest|Longest|Greatest|Fastest)\\w*|"
      "_?(MOST|LEAST|FARTHEST|LARGEST|LONGEST|GREATEST|FASTEST)(_\\w*)?)\\b");
  // A comment names its subject.
  static const std::regex subjects("^\\s*(//+<?|#) (.*[.:] )?(What|Which|Who)\\b(?!.*\\?)");
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (path.rfind("tests/architecture/", 0) == 0) continue;
    forEachLine(text, [&, &name = path](int number, const std::string& line) {
      for (std::sregex_iterator it(line.begin(), line.end(), words), end; it != end; ++it)
        faults.push_back(formatPlace(name, number) + ": " + (*it)[0].str());
      std::smatch match;
      if (std::regex_search(line, match, subjects))
        faults.push_back(formatPlace(name, number) + ": a comment about \"" + match[3].str() +
                         "\"; name the thing");
    });
  }
  return faults;
}

Faults findLongSentences(const Sources& sources, int maxWords) {
  static const std::regex fence("^\\s*```"), noText("^\\s*([#|].*)?$");
  static const std::regex item(R"(^\s*([-*+]|\d+\.)\s)");
  static const std::regex comment(R"(^(\s*|.*\S\s*)//+<?( (.*))?$)");
  Faults faults;
  for (const auto& [path, text] : sources) {
    const bool isPage = endsWith(path, ".md");
    if (!isPage && !isCode(path) && !endsWith(path, ".proto")) continue;
    int words = 0, firstLine = 0;
    bool inFence = false, inItem = false;
    const auto endSentence = [&, &name = path] {
      if (words > maxWords)
        faults.push_back(formatPlace(name, firstLine) + ": a sentence of " + std::to_string(words) +
                         " words; split it");
      words = 0;
    };
    const auto readLine = [&](int number, const std::string& line) {
      const bool isFence = std::regex_search(line, fence);
      if (isFence) inFence = !inFence;
      if (isFence || inFence || std::regex_search(line, noText)) return endSentence();
      if (std::regex_search(line, item)) endSentence();
      std::istringstream rest(line);
      for (std::string word; rest >> word;) {
        if (isWord(word) && ++words == 1) firstLine = number;
        if (endsSentence(word)) endSentence();
      }
    };
    forEachLine(text, [&](int number, const std::string& line) {
      if (isPage) return readLine(number, line);
      std::smatch match;
      const bool isComment =
          line.find("//") != std::string::npos && std::regex_match(line, match, comment);
      const bool followsCode =
          isComment && match[1].str().find_first_not_of(' ') != std::string::npos;
      const std::string written = isComment ? match[3].str() : "";
      const bool isIndented = written.starts_with(' ');
      inItem = std::regex_search(written, item) || (inItem && isIndented);
      const bool isFormula = isIndented && written.find(" = ") != std::string::npos;
      const bool isShown = isFormula || (isIndented && !inItem);  // also a table, an example
      if (followsCode || written.empty() || isShown) endSentence();
      if (!written.empty() && !isShown) readLine(number, written);
      if (followsCode) endSentence();
    });
    endSentence();
  }
  return faults;
}

Faults findNounFunctions(const Sources& sources) {
  // JavaScript itself names two methods of strings and arrays so.
  static const std::regex noun(R"(\b(?!(?:i|lastI)ndexOf\b)([a-z]\w*Of)(?:<[^<>()]*>)?\()");
  Faults faults;
  for (const auto& [path, text] : sources) {
    const bool isProduct = kMayInclude.count(path.substr(0, path.find('/'))) != 0;
    if (!isScript(path) && !(isCode(path) && isProduct)) continue;
    forEachLine(text, [&, &name = path](int number, const std::string& line) {
      for (std::sregex_iterator it(line.begin(), line.end(), noun), end; it != end; ++it)
        faults.push_back(formatPlace(name, number) + ": " + (*it)[1].str() +
                         "(); name it by a verb, as get.., find.., compute.. or make..");
    });
  }
  return faults;
}

Faults findBodyKindsLeftOut(const Sources& sources) {
  struct Place {
    const char* path;
    const char* before;  ///< the kind's name, as a regular expression
    const char* after;
  };
  static constexpr Place places[] = {
      {"protocol/enfilade.proto", R"(string kind = \d+; +//[^\n]*")", "\""},
      {"scene/import/bodies/SIDECAR.md", R"(\n\| `)", "` \\|"},
      {"server/page/src/panels/pick.ts", R"(const ACTIONS[^;]*\n  )", ": "},
  };
  static const std::regex row(R"re(\.name = "(\w+)")re");
  const auto table = sources.find("scene/model/body_spec.hpp");
  if (table == sources.end()) return {};
  Faults faults;
  for (std::sregex_iterator it(table->second.begin(), table->second.end(), row), end; it != end;
       ++it) {
    const std::string kind = (*it)[1].str();
    for (const Place& place : places) {
      const auto file = sources.find(place.path);
      const bool isThere =
          file != sources.end() &&
          std::regex_search(file->second, std::regex(place.before + kind + place.after));
      if (!isThere) faults.push_back(std::string(place.path) + ": no body kind \"" + kind + '"');
    }
  }
  return faults;
}

Faults findUnexplainedDiagnostics(const Sources& sources) {
  static const std::string table = "scene/model/diagnostic_catalog.cpp";
  static const std::regex reported(
      R"re((?:addDiagnostic\(|problems\.push_back\()[^";]*"([a-z_]+)")re");
  const auto meanings = sources.find(table);
  if (meanings == sources.end()) return {};
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (path.rfind("scene/", 0) != 0) continue;
    for (std::sregex_iterator it(text.begin(), text.end(), reported), end; it != end; ++it) {
      const std::string word = '"' + (*it)[1].str() + '"';
      if (meanings->second.find(word) != std::string::npos) continue;
      const auto line = 1 + std::count(text.begin(), text.begin() + it->position(), '\n');
      faults.push_back(formatPlace(path, static_cast<int>(line)) + ": " + word + " is not in " +
                       table);
    }
  }
  return faults;
}

Faults findSharedTemporaryFiles(const Sources& sources) {
  static const std::string keeper = "tests/support/temporary_folder.hpp";
  static const std::regex shared(R"(\b(temp_directory_path|TempDir)\()");
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (path.rfind("tests/", 0) != 0 || path == keeper || path.rfind("tests/architecture/", 0) == 0)
      continue;
    for (std::sregex_iterator it(text.begin(), text.end(), shared), end; it != end; ++it) {
      const auto line = 1 + std::count(text.begin(), text.begin() + it->position(), '\n');
      faults.push_back(formatPlace(path, static_cast<int>(line)) + ": files of a test come from " +
                       keeper);
    }
  }
  return faults;
}

Faults findBrokenLinks(const Sources& sources) {
  static const std::regex link(R"(\]\(([A-Za-z0-9_./-]+)(#[^)]*)?\))");
  Faults faults;
  for (const auto& [path, text] : sources) {
    if (!endsWith(path, ".md")) continue;
    const auto folder = std::filesystem::path(path).parent_path();
    forEachLine(text, [&, &name = path](int number, const std::string& line) {
      for (std::sregex_iterator it(line.begin(), line.end(), link), end; it != end; ++it) {
        const std::string target = (*it)[1];
        const auto file = (folder / target).lexically_normal().generic_string();
        if (sources.count(file) == 0)
          faults.push_back(formatPlace(name, number) + ": links to " + target +
                           ", which is not there");
      }
    });
  }
  return faults;
}

}  // namespace enfilade::architecture
