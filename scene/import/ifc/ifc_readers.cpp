#include "scene/import/ifc/ifc_readers.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <future>
#include <limits>
#include <mutex>
#include <numeric>

#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMaxStarts = 8;           // of web-ifc per part of a file; each parses the part again
constexpr double kProductTimeout = 20;  // seconds that web-ifc may spend on one product

/// Copies `bytes` to anonymous memory and returns its file descriptor.
int createSharedMemory(const void* bytes, std::size_t size, const std::string& file) {
  int fd = -1;
  const auto fail = [&] {
    const std::string reason = std::strerror(errno);
    if (fd >= 0) close(fd);
    throw ImportError(file + ": no memory to pass the file to its reader: " + reason);
  };
  const int low = memfd_create("enfilade-ifc", MFD_CLOEXEC);
  if (low < 0) fail();
  fd = fcntl(low, F_DUPFD_CLOEXEC, kFirstParentDescriptor);
  close(low);
  if (fd < 0) fail();
  const auto* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = write(fd, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) fail();
    next += written;
    size -= static_cast<std::size_t>(written);
  }
  return fd;
}

/// Status that a reader has reported so far.
struct ReaderStatus {
  std::string stage = "start";
  std::string error;
  bool done = false;
  std::optional<std::uint32_t> trying;
};

std::string toString(std::span<const std::byte> body) {
  return {reinterpret_cast<const char*>(body.data()), body.size()};
}

bool handleMessage(ImportMessage kind, std::span<const std::byte> body,
                   const ImportProgress& progress, ReaderStatus& status, IfcMeshes& meshes) {
  double fraction = 0;
  std::uint32_t index = 0;
  switch (kind) {
    case ImportMessage::progress:
      if (!readProgress(body, status.stage, fraction)) return false;
      if (progress) progress(status.stage, fraction);
      return true;
    case ImportMessage::error:
      status.error = toString(body);
      return true;
    case ImportMessage::done:
      status.done = true;
      return true;
    case ImportMessage::trying:
      if (body.size() != sizeof index) return false;
      std::memcpy(&index, body.data(), sizeof index);
      status.trying = index;
      return true;
    default:
      return readIfcMessage(kind, body, meshes);
  }
}

/// Reason for a reader's early end; empty: complete.
std::string describeFailure(const ReaderStatus& status, const ImportExit& end) {
  if (status.done) return {};
  if (!status.error.empty()) return status.error;
  return end.describe() + " during '" + status.stage + "'";
}

double noTimeout() {
  return std::numeric_limits<double>::infinity();
}

}  // namespace

IfcInput::IfcInput(const ImportRequest& request, const std::string& text,
                   std::vector<std::uint32_t> wanted, const std::vector<IfcPart>& parts)
    : IfcInput(request) {  // so that the destructor runs if something below throws
  fileDescriptor_ = createSharedMemory(text.data(), text.size(), request.file);
  listDescriptor_ =
      createSharedMemory(wanted.data(), wanted.size() * sizeof wanted[0], request.file);
  for (const IfcPart& part : parts) addPart(part);
  if (parts.empty()) addPart({std::move(wanted), {{0, text.size()}}});
}

void IfcInput::addPart(const IfcPart& part) {
  const std::uint64_t count = part.ranges.size();
  const auto append = [](std::string& to, const auto* values, std::size_t size) {
    to.append(reinterpret_cast<const char*>(values), size);
  };
  std::string list;
  append(list, &count, sizeof count);
  append(list, part.ranges.data(), part.ranges.size() * sizeof part.ranges[0]);
  append(list, part.products.data(), part.products.size() * sizeof part.products[0]);
  parts_.push_back({part.products, createSharedMemory(list.data(), list.size(), request_.file)});
}

IfcInput::~IfcInput() {
  close(fileDescriptor_);
  close(listDescriptor_);
  for (const Part& part : parts_) close(part.listDescriptor);
}

ImportRequest IfcInput::makeRequest(ImportTask task, double timeLimit) const {
  ImportRequest request = request_;
  request.task = task;
  request.options.timeLimit = timeLimit;
  request.ifcFile = fileDescriptor_;
  request.ifcProductIds = listDescriptor_;
  return request;
}

namespace {

/// Records products from index `first` on as not tried, to distinguish them from products without
/// triangles.
void markNotTried(std::size_t first, const std::vector<std::uint32_t>& wanted,
                  IfcReadResult& result) {
  for (std::size_t i = first; i < wanted.size(); ++i)
    if (!result.meshes.products.contains(wanted[i]))
      result.meshes.failures.try_emplace(wanted[i], "not tried: web-ifc " + result.failure);
}

IfcReadResult readPart(const IfcInput& input, const IfcInput::Part& part,
                       const WebIfcLocation& location, double timeLimit,
                       const ImportProgress& progress) {
  IfcReadResult result;
  const std::vector<std::uint32_t>& products = part.products;
  const auto start = Clock::now();
  std::uint32_t first = 0;
  for (int starts = 0; starts < kMaxStarts; ++starts) {
    const double used = std::chrono::duration<double>(Clock::now() - start).count();
    ImportRequest request = input.makeRequest(ImportTask::webIfc, timeLimit - used);
    request.ifcProductIds = part.listDescriptor;
    request.program = location.node;
    request.script = location.script;
    request.firstProduct = first;
    ReaderStatus status;
    const ImportExit end = runImportProcess(
        request,
        [&](ImportMessage kind, std::span<const std::byte> body) {
          return handleMessage(kind, body, progress, status, result.meshes);
        },
        [&] { return status.trying ? kProductTimeout : noTimeout(); });
    result.failure = describeFailure(status, end);
    const bool failedOnProduct = status.trying && *status.trying < products.size();
    if (status.done) return result;
    if (!failedOnProduct || end.reason == ImportExit::Reason::timeLimit) {
      markNotTried(status.trying.value_or(first), products, result);
      return result;
    }
    // One product crashed the reader: skip it and keep the meshes of the others.
    const std::uint32_t culprit = products[*status.trying];
    result.meshes.products.erase(culprit);
    result.meshes.failures.try_emplace(culprit, "web-ifc " + result.failure);
    first = *status.trying + 1;
  }
  markNotTried(first, products, result);
  return result;
}

/// Progress of all parts, as that of one reader.
class JoinedProgress {
 public:
  JoinedProgress(std::size_t parts, const ImportProgress& progress)
      : fractions_(parts), progress_(progress) {}

  ImportProgress makeProgress(std::size_t part) {
    return [this, part](const std::string& stage, double fraction) {
      const std::lock_guard lock(mutex_);
      fractions_[part] = fraction;
      if (progress_)
        progress_(stage, std::reduce(fractions_.begin(), fractions_.end()) /
                             static_cast<double>(fractions_.size()));
    };
  }

 private:
  std::mutex mutex_;
  std::vector<double> fractions_;
  const ImportProgress& progress_;
};

/// A geometry that several parts deliver is the same in each.
void mergeResult(IfcReadResult&& from, IfcReadResult& to) {
  to.meshes.geometries.merge(from.meshes.geometries);
  to.meshes.products.merge(from.meshes.products);
  to.meshes.failures.merge(from.meshes.failures);
  if (to.failure.empty()) to.failure = std::move(from.failure);
}

}  // namespace

IfcReadResult readWithWebIfc(const IfcInput& input, double timeLimit,
                             const ImportProgress& progress) {
  IfcReadResult result;
  const WebIfcLocation location = findWebIfc();
  if (!location.missing.empty()) {
    result.failure = location.missing;
    result.notInstalled = true;
    return result;
  }
  const std::vector<IfcInput::Part>& parts = input.parts();
  if (parts.size() == 1) return readPart(input, parts[0], location, timeLimit, progress);
  JoinedProgress joined(parts.size(), progress);
  std::vector<std::future<IfcReadResult>> readings;
  const auto read = [&](std::size_t i) {
    return readPart(input, parts[i], location, timeLimit, joined.makeProgress(i));
  };
  for (std::size_t i = 0; i + 1 < parts.size(); ++i)  // one after another where threads are short
    readings.push_back(std::async(std::launch::async | std::launch::deferred, read, i));
  mergeResult(read(parts.size() - 1), result);
  for (std::future<IfcReadResult>& reading : readings) mergeResult(reading.get(), result);
  return result;
}

IfcReadResult readWithIfcPlusPlus(const IfcInput& input, double timeLimit,
                                  const ImportProgress& progress) {
  IfcReadResult result;
  ReaderStatus status;
  const ImportExit end = runImportProcess(
      input.makeRequest(ImportTask::ifcPlusPlus, timeLimit),
      [&](ImportMessage kind, std::span<const std::byte> body) {
        return handleMessage(kind, body, progress, status, result.meshes);
      },
      noTimeout);
  result.failure = describeFailure(status, end);
  return result;
}

AssimpReadResult readIfcWithAssimp(const IfcInput& input, double timeLimit,
                                   const ImportProgress& progress) {
  AssimpReadResult result;
  ReaderStatus status;
  IfcMeshes noMeshes;
  const ImportExit end = runImportProcess(
      input.makeRequest(ImportTask::assimp, timeLimit),
      [&](ImportMessage kind, std::span<const std::byte> body) {
        if (kind != ImportMessage::model)
          return handleMessage(kind, body, progress, status, noMeshes);
        try {
          result.model = deserializeModel(body);
        } catch (const ModelStreamError&) {
          return false;
        }
        return status.done = true;
      },
      noTimeout);
  result.failure = describeFailure(status, end);
  return result;
}

}  // namespace enfilade::scene
