// Layout of the cache. An entry's name is the hash of the model file's content, the options, this
// program's build id and the readers' versions. The entry holds hashes of all other files that the
// import read, and the names of files that it did not find. They are compared before the entry is
// used. Entries are written under a temporary name and renamed, so an entry is complete; its
// checksum detects later damage.
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

#include "scene/base/elapsed.hpp"
#include "scene/import/cache/deduplicate_meshes.hpp"
#include "scene/import/cache/model_cache_entry.hpp"
#include "scene/import/file/content_hash.hpp"
#include "scene/import/file/model_format.hpp"
#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/import_model.hpp"
#include "scene/import/toolchain_version.hpp"
#include "scene/import/worker/model_stream.hpp"
#include "scene/model/ascii.hpp"

namespace enfilade::scene {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

constexpr const char* kModelExtension = ".model";
constexpr const char* kTextExtension = ".text";
constexpr const char* kTemporaryExtension = ".unfinished";
constexpr auto kTemporaryLifetime =
    std::chrono::hours(1);  // a temporary file this old is abandoned

// ---- keys --------------------------------------------------------------------------------------

std::string formatOptions(const ImportOptions& options) {
  std::string text = "unit ";
  text += options.metresPerUnit
              ? std::to_string(std::bit_cast<std::uint64_t>(*options.metresPerUnit))
              : "-";
  text += " up ";
  text += options.up ? toString(*options.up) : "-";
  text += " offset ";
  for (int i = 0; i < 3; ++i)
    text += options.offset
                ? std::to_string(std::bit_cast<std::uint64_t>((*options.offset)[i])) + ","
                : "-";
  text += " ifc reader " + std::to_string(static_cast<int>(options.ifcReader));
  if (options.georeference) text += " on the map";
  if (options.ignoreAppearance) text += " without required appearance";
  if (!options.gltfScene.empty()) text += " scene " + options.gltfScene;
  return text;
}

/// Describes readers that are not libraries of this program.
std::string describeExternalReaders(const fs::path& file) {
  if (detectModelFormat(file) != ModelFormat::ifc) return {};
  const WebIfcLocation location = findWebIfc();
  if (!location.missing.empty()) return " without web-ifc";
  const fs::path folder = fs::path(location.script).parent_path();
  std::string text = " web-ifc";
  for (const char* part :
       {"read_ifc.js", "engine.js", "worker_io.js", "convert_ifcxml.js", "ifcxml_document.js",
        "ifcxml_converter.js", "ifc_schema.js", "step_text.js", "node_modules/web-ifc/package.json",
        "node_modules/saxes/package.json"})
    text += " " + toHex(computeFileHash(folder / part).value_or(ContentHash{}));
  return text;
}

/// Returns whether another import of the same file might read more: a reader timed out or failed
/// for a reason that may be temporary.
bool isProvisional(const Model& model) {
  return std::any_of(
      model.diagnostics.begin(), model.diagnostics.end(),
      [](const Diagnostic& diagnostic) { return diagnostic.kind == "ifc_reader_failed"; });
}

/// Computes the key; nullopt if the file cannot be read (the import reports why).
std::optional<ContentHash> computeKey(const fs::path& file, const ImportOptions& options) {
  const auto content = computeFileHash(file);
  if (!content) return std::nullopt;
  const std::string extension = toLowerCase(file.extension().string());
  return computeContentHash(toHex(*content) + extension + " " + formatOptions(options) +
                            " stream " + std::to_string(kModelStreamVersion) + " " +
                            describeReaderVersions() + describeExternalReaders(file));
}

/// Fingerprints a dependency. A relative path is relative to the model's folder.
Dependency computeFingerprint(const fs::path& file, const std::string& path) {
  const auto content = computeFileVersion(file.parent_path() / path);
  return {path, content.has_value(), content.value_or(ContentHash{})};
}

/// Lists the dependencies, relative to the model's folder if they lie below it, so that the folder
/// may be moved.
std::vector<Dependency> listDependencies(const fs::path& file, const Model& model) {
  const fs::path folder = fs::absolute(file).lexically_normal().parent_path();
  std::vector<std::string> paths;
  for (const std::string& dependency : model.dependencies) {
    const fs::path whole = fs::absolute(dependency).lexically_normal();
    const fs::path below = whole.lexically_relative(folder);
    const bool outside = below.empty() || *below.begin() == "..";
    paths.push_back((outside ? whole : below).string());
  }
  std::sort(paths.begin(), paths.end());
  paths.erase(std::unique(paths.begin(), paths.end()), paths.end());
  std::erase(paths, file.filename().string());
  std::vector<Dependency> files;
  for (const std::string& path : paths) files.push_back(computeFingerprint(file, path));
  return files;
}

// ---- reading ------------------------------------------------------------------------------------

/// An entry's file mapped into memory. Entries are replaced and removed, but never truncated while
/// a reader may map them.
class MappedFile {
 public:
  explicit MappedFile(const fs::path& path) {
    const int fd = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (fd < 0) return;
    exists_ = true;
    struct stat status {};
    if (fstat(fd, &status) == 0 && status.st_size > 0) {
      size_ = static_cast<std::size_t>(status.st_size);
      data_ = mmap(nullptr, size_, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0);
      if (data_ == MAP_FAILED) size_ = 0;
    }
    close(fd);
  }
  ~MappedFile() {
    if (size_ > 0) munmap(data_, size_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;

  bool exists() const { return exists_; }
  std::span<const std::byte> bytes() const { return {static_cast<const std::byte*>(data_), size_}; }

 private:
  bool exists_ = false;
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

std::optional<CacheEntry> findEntry(const fs::path& file, const fs::path& path,
                                    const ContentHash& key, std::vector<std::string>& notes) {
  const MappedFile mapped(path);
  if (!mapped.exists()) return std::nullopt;
  try {
    CacheEntry entry = deserializeEntry(mapped.bytes());
    if (!(entry.key == key)) throw ModelStreamError("cache entry: belongs to another file");
    const bool same = std::all_of(entry.dependencies.begin(), entry.dependencies.end(),
                                  [&](const Dependency& dependency) {
                                    return computeFingerprint(file, dependency.path) == dependency;
                                  });
    if (!same) return std::nullopt;
    utimensat(AT_FDCWD, path.c_str(), nullptr, 0);  // marks it as recently used
    return entry;
  } catch (const ModelStreamError& error) {
    notes.push_back(path.string() + ": " + error.what() + "; the model is imported again");
    return std::nullopt;
  }
}

// ---- writing ------------------------------------------------------------------------------------

struct StoredEntry {
  fs::path path;
  std::uintmax_t bytes = 0;
  fs::file_time_type lastUsed;
};

/// Lists the entries, and removes temporary files of programs that died.
std::vector<StoredEntry> listEntries(const fs::path& folder) {
  std::vector<StoredEntry> entries;
  std::error_code error;
  for (const auto& found : fs::directory_iterator(folder, error)) {
    const fs::path& path = found.path();
    const auto lastUsed = found.last_write_time(error);
    if (path.extension() == kTemporaryExtension &&
        lastUsed < fs::file_time_type::clock::now() - kTemporaryLifetime)
      fs::remove(path, error);
    if (path.extension() == kModelExtension || path.extension() == kTextExtension)
      entries.push_back({path, found.file_size(error), lastUsed});
  }
  return entries;
}

/// Evicts the least recently read entries until `incomingBytes` fit.
void evictOldEntries(const ModelCache& cache, std::uintmax_t incomingBytes) {
  std::vector<StoredEntry> entries = listEntries(cache.folder);
  std::sort(entries.begin(), entries.end(),
            [](const StoredEntry& a, const StoredEntry& b) { return a.lastUsed < b.lastUsed; });
  std::uintmax_t totalBytes = incomingBytes;
  for (const StoredEntry& entry : entries) totalBytes += entry.bytes;
  for (const StoredEntry& entry : entries) {
    if (totalBytes <= cache.maxBytes) return;
    std::error_code error;
    if (fs::remove(entry.path, error)) totalBytes -= entry.bytes;
  }
}

/// Writes all bytes to `fd`. Returns errno, or 0.
int writeAllBytes(int fd, const std::vector<std::byte>& bytes) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t size = write(fd, bytes.data() + done, bytes.size() - done);
    if (size < 0 && errno == EINTR) continue;
    if (size <= 0) return size < 0 ? errno : EIO;
    done += static_cast<std::size_t>(size);
  }
  return 0;
}

/// Writes to a temporary file and renames it. Returns the error, or "".
std::string writeAtomically(const fs::path& path, const std::vector<std::byte>& bytes) {
  std::string unfinished = path.string() + ".XXXXXX" + kTemporaryExtension;
  const int fd =
      mkostemps(unfinished.data(), static_cast<int>(std::strlen(kTemporaryExtension)), O_CLOEXEC);
  if (fd < 0) return path.parent_path().string() + ": " + std::strerror(errno);
  int error = writeAllBytes(fd, bytes);
  if (close(fd) != 0 && error == 0) error = errno;
  if (error == 0 && rename(unfinished.c_str(), path.c_str()) != 0) error = errno;
  if (error == 0) return "";
  unlink(unfinished.c_str());
  return path.string() + ": " + std::strerror(error);
}

std::string storeBytes(const ModelCache& cache, const fs::path& path,
                       const std::vector<std::byte>& bytes) {
  std::error_code error;
  fs::create_directories(cache.folder, error);
  if (error) return cache.folder.string() + ": " + error.message();
  if (bytes.size() > cache.maxBytes) {
    return path.string() + ": " + std::to_string(bytes.size() >> 20) + " MB exceed the cache limit";
  }
  evictOldEntries(cache, bytes.size());
  return writeAtomically(path, bytes);
}

/// File name of a cached text, and the checksum that precedes the text in the file.
fs::path makeTextPath(const ModelCache& cache, const std::string& key) {
  return cache.folder /
         (toHex(computeContentHash(key + " " + describeReaderVersions())) + kTextExtension);
}
std::string computeTextChecksum(const std::string& key, std::string_view text) {
  return toHex(computeContentHash(key + " " + std::string(text)));
}

LoadedModel importUncached(const fs::path& file, const ImportOptions& options,
                           const ImportProgress& progress) {
  const auto start = Clock::now();
  LoadedModel loaded;
  loaded.model = importModel(file, options, progress);
  deduplicateMeshes(loaded.model);
  loaded.importSeconds = measureSecondsSince(start);
  return loaded;
}

std::optional<std::string> readEnvironment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr || *value == '\0' ? std::nullopt : std::optional<std::string>(value);
}

std::optional<fs::path> findCacheFolder() {
  const auto setting = readEnvironment("ENFILADE_CACHE");
  if (setting == "off") return std::nullopt;
  if (setting && fs::path(*setting).is_absolute()) return fs::path(*setting);
  // The specification says to ignore relative paths.
  if (const auto caches = readEnvironment("XDG_CACHE_HOME");
      caches && fs::path(*caches).is_absolute())
    return fs::path(*caches) / "enfilade";
  if (const auto home = readEnvironment("HOME")) return fs::path(*home) / ".cache" / "enfilade";
  return std::nullopt;
}

}  // namespace

std::optional<ModelCache> findDefaultModelCache() {
  const std::optional<fs::path> folder = findCacheFolder();
  if (!folder) return std::nullopt;
  ModelCache cache{*folder};
  if (const auto limit = readEnvironment("ENFILADE_CACHE_MB")) {
    std::uintmax_t megabytes = 0;
    const char* end = limit->data() + limit->size();
    const auto read = std::from_chars(limit->data(), end, megabytes);
    if (read.ec == std::errc() && read.ptr == end && megabytes < (1u << 30))
      cache.maxBytes = megabytes << 20;
  }
  return cache;
}

LoadedModel loadModel(const fs::path& file, const ImportOptions& options,
                      const std::optional<ModelCache>& cache, const ImportProgress& progress) {
  const auto start = Clock::now();
  const auto key = cache ? computeKey(file, options) : std::nullopt;
  LoadedModel loaded;
  if (!key) {
    loaded = importUncached(file, options, progress);
    loaded.loadSeconds = measureSecondsSince(start);
    return loaded;
  }
  const fs::path path = cache->folder / (toHex(*key) + kModelExtension);
  std::vector<std::string> notes;
  if (auto entry = findEntry(file, path, *key, notes)) {
    loaded.model = std::move(entry->model);
    loaded.model.source = file.string();
    loaded.fromCache = true;
    loaded.importSeconds = entry->importSeconds;
  } else {
    loaded = importUncached(file, options, progress);
    CacheEntry newEntry{*key, loaded.importSeconds, listDependencies(file, loaded.model), {}};
    // The file may have been saved during the import.
    if (!isProvisional(loaded.model) && computeKey(file, options) == key) {
      newEntry.model = std::move(loaded.model);
      const std::string failure = storeBytes(*cache, path, serializeEntry(newEntry));
      if (!failure.empty()) notes.push_back("not cached for the next start: " + failure);
      loaded.model = std::move(newEntry.model);
    }
  }
  loaded.notes = std::move(notes);
  loaded.loadSeconds = measureSecondsSince(start);
  return loaded;
}

std::optional<std::string> loadCachedText(const ModelCache& cache, const std::string& key,
                                          std::string* damage) {
  const fs::path path = makeTextPath(cache, key);
  const MappedFile mapped(path);
  const std::string_view whole(reinterpret_cast<const char*>(mapped.bytes().data()),
                               mapped.bytes().size());
  const std::size_t checksumSize = computeTextChecksum(key, "").size();
  if (whole.size() < checksumSize ||
      whole.substr(0, checksumSize) != computeTextChecksum(key, whole.substr(checksumSize))) {
    if (damage && mapped.exists()) *damage = path.string() + ": damaged (its checksum differs)";
    return std::nullopt;
  }
  utimensat(AT_FDCWD, path.c_str(), nullptr, 0);
  return std::string(whole.substr(checksumSize));
}

std::string storeCachedText(const ModelCache& cache, const std::string& key,
                            const std::string& text) {
  const std::string whole = computeTextChecksum(key, text) + text;
  const auto* first = reinterpret_cast<const std::byte*>(whole.data());
  return storeBytes(cache, makeTextPath(cache, key), {first, first + whole.size()});
}

}  // namespace enfilade::scene
