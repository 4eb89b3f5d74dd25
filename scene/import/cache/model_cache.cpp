// The name of an entry is the hash of the model file's bytes, the options, and who reads it: this
// program as it was linked and the readers' versions. In the entry stand the hashes of the other
// files that the import read, and the names of those that it looked for in vain; they are compared
// before the entry serves. Entries are written under another name and renamed, so that one with the
// right name is whole; what a broken disk makes of it afterwards, its checksum tells.
#include "scene/import/cache/model_cache.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>

#include "scene/import/cache/deduplicate_meshes.hpp"
#include "scene/import/cache/model_cache_entry.hpp"
#include "scene/import/file_metadata.hpp"
#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/toolchain_version.hpp"
#include "scene/import/worker/content_hash.hpp"
#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kEnding = ".model";
constexpr const char* kTextEnding = ".text";
constexpr const char* kUnfinished = ".unfinished";
constexpr auto kAbandoned = std::chrono::hours(1);  // an unfinished entry that nobody finishes

double secondsSince(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

// ---- what an entry is found by ------------------------------------------------------------------

std::string optionText(const ImportOptions& options) {
  std::string text = "unit ";
  text += options.metresPerUnit
              ? std::to_string(std::bit_cast<std::uint64_t>(*options.metresPerUnit))
              : "-";
  text += " up ";
  text += options.up ? std::string(1, *options.up) : "-";
  text += " offset ";
  for (int i = 0; i < 3; ++i)
    text += options.offset
                ? std::to_string(std::bit_cast<std::uint64_t>((*options.offset)[i])) + ","
                : "-";
  text += " ifc reader " + std::to_string(static_cast<int>(options.ifcReader));
  return text;
}

/// Readers that are no libraries of this program.
std::string outerReaders(const fs::path& file) {
  if (modelFormatOf(file) != ModelFormat::ifc) return {};
  const WebIfcPlace place = findWebIfc();
  if (!place.missing.empty()) return " without web-ifc";
  const fs::path script = place.script;
  std::string text = " web-ifc";
  for (const fs::path& part : {script, script.parent_path() / "node_modules/web-ifc/package.json"})
    text += " " + hexOf(contentHashOfFile(part).value_or(ContentHash{}));
  return text;
}

/// Whether another import of the same file might make more of it: a reader took too long, or was
/// brought down by something that may not last.
bool isMakeshift(const Model& model) {
  return std::any_of(model.problems.begin(), model.problems.end(),
                     [](const Problem& problem) { return problem.kind == "ifc_reader_failed"; });
}

/// nullopt when the file cannot be read: the import will say why.
std::optional<ContentHash> keyOf(const fs::path& file, const ImportOptions& options) {
  const auto content = contentHashOfFile(file);
  if (!content) return std::nullopt;
  std::string extension = file.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return contentHash(hexOf(*content) + extension + " " + optionText(options) + " stream " +
                     std::to_string(kModelStreamVersion) + " " + readerVersions() +
                     outerReaders(file));
}

/// As it is now; the path is taken relative to the model's folder where the entry says so.
FileBeside lookAt(const fs::path& file, const std::string& path) {
  const auto content = versionOf(file.parent_path() / path);
  return {path, content.has_value(), content.value_or(ContentHash{})};
}

/// Relative to the model's folder where they lie below it, so that the folder may be moved.
std::vector<FileBeside> filesBeside(const fs::path& file, const Model& model) {
  const fs::path folder = fs::absolute(file).lexically_normal().parent_path();
  std::vector<std::string> paths;
  for (const std::string& named : model.filesBeside) {
    const fs::path whole = fs::absolute(named).lexically_normal();
    const fs::path below = whole.lexically_relative(folder);
    const bool outside = below.empty() || *below.begin() == "..";
    paths.push_back((outside ? whole : below).string());
  }
  std::sort(paths.begin(), paths.end());
  paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
  std::erase(paths, file.filename().string());
  std::vector<FileBeside> files;
  for (const std::string& path : paths) files.push_back(lookAt(file, path));
  return files;
}

// ---- reading ------------------------------------------------------------------------------------

/// An entry's bytes as the file holds them, not copied. Entries are replaced and removed, and never
/// cut short while somebody may read them.
class EntryFile {
 public:
  explicit EntryFile(const fs::path& path) {
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return;
    there_ = true;
    struct stat status {};
    if (fstat(fd, &status) == 0 && status.st_size > 0) {
      size_ = static_cast<std::size_t>(status.st_size);
      data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0);
      if (data_ == MAP_FAILED) size_ = 0;
    }
    close(fd);
  }
  ~EntryFile() {
    if (size_ > 0) munmap(data_, size_);
  }
  EntryFile(const EntryFile&) = delete;
  EntryFile& operator=(const EntryFile&) = delete;

  bool there() const { return there_; }
  std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

 private:
  bool there_ = false;
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

std::optional<CacheEntry> entryFor(const fs::path& file, const fs::path& path,
                                   const ContentHash& key, std::vector<std::string>& notes) {
  const EntryFile kept(path);
  if (!kept.there()) return std::nullopt;
  try {
    CacheEntry entry = deserialiseEntry(kept.bytes());
    if (!(entry.key == key)) throw ModelStreamError("cache entry: of another file");
    const bool same =
        std::all_of(entry.beside.begin(), entry.beside.end(),
                    [&](const FileBeside& beside) { return lookAt(file, beside.path) == beside; });
    if (!same) return std::nullopt;
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // read now: it goes last
    return entry;
  } catch (const ModelStreamError& error) {
    notes.push_back(path.string() + ": " + error.what() + "; the model is imported again");
    return std::nullopt;
  }
}

// ---- writing ------------------------------------------------------------------------------------

struct Entry {
  fs::path path;
  std::uintmax_t bytes = 0;
  fs::file_time_type used;
};

/// The entries in the folder; unfinished ones of programs that died are removed.
std::vector<Entry> entriesIn(const fs::path& folder) {
  std::vector<Entry> entries;
  std::error_code error;
  for (const auto& found : fs::directory_iterator(folder, error)) {
    const fs::path& path = found.path();
    const auto used = found.last_write_time(error);
    if (path.extension() == kUnfinished && used < fs::file_time_type::clock::now() - kAbandoned)
      fs::remove(path, error);
    if (path.extension() == kEnding || path.extension() == kTextEnding)
      entries.push_back({path, found.file_size(error), used});
  }
  return entries;
}

/// Removes what was not read for longest until `coming` bytes fit.
void makeRoom(const ModelCache& cache, std::uintmax_t coming) {
  std::vector<Entry> entries = entriesIn(cache.folder);
  std::sort(entries.begin(), entries.end(),
            [](const Entry& a, const Entry& b) { return a.used < b.used; });
  std::uintmax_t sum = coming;
  for (const Entry& entry : entries) sum += entry.bytes;
  for (const Entry& entry : entries) {
    if (sum <= cache.mostBytes) return;
    std::error_code error;
    if (fs::remove(entry.path, error)) sum -= entry.bytes;
  }
}

/// Why the bytes could not be written to `fd`; 0 when they were.
int writeAll(int fd, const std::vector<std::byte>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t size = write(fd, bytes.data() + done, bytes.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return size < 0 ? errno : EIO;
    done += static_cast<std::size_t>(size);
  }
  return 0;
}

/// Under another name, then renamed. Returns what went wrong, or "".
std::string writeWhole(const fs::path& path, const std::vector<std::byte>& bytes) {
  std::string unfinished = path.string() + ".XXXXXX" + kUnfinished;
  const int fd =
      mkostemps(unfinished.data(), static_cast<int>(std::strlen(kUnfinished)), O_CLOEXEC);
  if (fd < 0) return path.parent_path().string() + ": " + std::strerror(errno);
  int error = writeAll(fd, bytes);
  if (close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && rename(unfinished.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return "";
  unlink(unfinished.c_str());
  return path.string() + ": " + std::strerror(error);
}

std::string keepBytes(const ModelCache& cache, const fs::path& path,
                      const std::vector<std::byte>& bytes) {
  std::error_code error;
  fs::create_directories(cache.folder, error);
  if (error) return cache.folder.string() + ": " + error.message();
  if (bytes.size() > cache.mostBytes) {
    return path.string() + ": " + std::to_string(bytes.size() >> 20) +
           " MB are more than the cache may hold";
  }
  makeRoom(cache, bytes.size());
  return writeWhole(path, bytes);
}

/// The name of a kept text and, before the text itself, its checksum.
fs::path textPath(const ModelCache& cache, const std::string& key) {
  return cache.folder / (hexOf(contentHash(key + " " + readerVersions())) + kTextEnding);
}
std::string checksumOf(const std::string& key, std::string_view text) {
  return hexOf(contentHash(key + " " + std::string(text)));
}

LoadedModel imported(const fs::path& file, const ImportOptions& options,
                     const ImportProgress& progress) {
  const auto start = Clock::now();
  LoadedModel loaded;
  loaded.model = importModel(file, options, progress);
  shareEqualMeshes(loaded.model);
  loaded.importSeconds = secondsSince(start);
  return loaded;
}

std::optional<std::string> environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? std::nullopt : std::optional<std::string>(value);
}

std::optional<fs::path> cacheFolder() {
  const auto told = environment("ENFILADE_CACHE");
  if (told == "off") return std::nullopt;
  if (told && fs::path(*told).is_absolute()) return fs::path(*told);
  // Relative paths are to be ignored, says the specification.
  if (const auto caches = environment("XDG_CACHE_HOME"); caches && fs::path(*caches).is_absolute())
    return fs::path(*caches) / "enfilade";
  if (const auto home = environment("HOME")) return fs::path(*home) / ".cache" / "enfilade";
  return std::nullopt;
}

}  // namespace

std::optional<ModelCache> modelCacheOfEnvironment() {
  const std::optional<fs::path> folder = cacheFolder();
  if (!folder) return std::nullopt;
  ModelCache cache{*folder};
  if (const auto bound = environment("ENFILADE_CACHE_MB")) {
    std::uintmax_t megabytes = 0;
    const char* end = bound->data() + bound->size();
    const auto read = std::from_chars(bound->data(), end, megabytes);
    if (read.ec == std::errc() && read.ptr == end && megabytes < (1u << 30))
      cache.mostBytes = megabytes << 20;
  }
  return cache;
}

LoadedModel loadModel(const fs::path& file, const ImportOptions& options,
                      const std::optional<ModelCache>& cache, const ImportProgress& progress) {
  const auto start = Clock::now();
  const auto key = cache ? keyOf(file, options) : std::nullopt;
  LoadedModel loaded;
  if (!key) {
    loaded = imported(file, options, progress);
    loaded.loadSeconds = secondsSince(start);
    return loaded;
  }
  const fs::path path = cache->folder / (hexOf(*key) + kEnding);
  std::vector<std::string> notes;
  if (auto entry = entryFor(file, path, *key, notes)) {
    loaded.model = std::move(entry->model);
    loaded.model.source = file.string();
    loaded.fromCache = true;
    loaded.importSeconds = entry->importSeconds;
  } else {
    loaded = imported(file, options, progress);
    CacheEntry made{*key, loaded.importSeconds, filesBeside(file, loaded.model), {}};
    // Somebody may have saved the file while it was read.
    if (!isMakeshift(loaded.model) && keyOf(file, options) == key) {
      made.model = std::move(loaded.model);
      const std::string wrong = keepBytes(*cache, path, serialiseEntry(made));
      if (!wrong.empty()) notes.push_back("not kept for the next start: " + wrong);
      loaded.model = std::move(made.model);
    }
  }
  loaded.notes = std::move(notes);
  loaded.loadSeconds = secondsSince(start);
  return loaded;
}

std::optional<std::string> keptText(const ModelCache& cache, const std::string& key) {
  const fs::path path = textPath(cache, key);
  const EntryFile kept(path);
  const std::string_view whole(reinterpret_cast<const char*>(kept.bytes().data()),
                               kept.bytes().size());
  const std::size_t sum = checksumOf(key, "").size();
  if (whole.size() < sum || whole.substr(0, sum) != checksumOf(key, whole.substr(sum)))
    return std::nullopt;
  utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
  return std::string(whole.substr(sum));
}

std::string keepText(const ModelCache& cache, const std::string& key, const std::string& text) {
  const std::string whole = checksumOf(key, text) + text;
  const auto* first = reinterpret_cast<const std::byte*>(whole.data());
  return keepBytes(cache, textPath(cache, key), {first, first + whole.size()});
}

}  // namespace enfilade::scene
