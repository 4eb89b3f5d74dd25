#include "scene/import/ifc/ifc_readers.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>
#include <numeric>
#include <utility>

#include "collision/assert.hpp"
#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMaxStarts = 8;           // of web-ifc per part of a file; each parses the part again
constexpr double kProductTimeout = 20;  // seconds that web-ifc may spend on one product

[[noreturn]] void throwNoMemory(const std::string& file) {
  throw ImportError(file + ": no memory to pass the file to its reader: " + std::strerror(errno));
}

/// Moves a descriptor out of the way of those of a worker; -1 stays.
int moveUp(int low) {
  if (low < 0) return -1;
  const int fd = fcntl(low, F_DUPFD_CLOEXEC, kFirstParentDescriptor);
  close(low);
  return fd;
}

/// Anonymous memory, as a file descriptor.
int openSharedMemory(const std::string& file) {
  const int fd = moveUp(memfd_create("enfilade-ifc", MFD_CLOEXEC));
  if (fd < 0) throwNoMemory(file);
  return fd;
}

void writeShared(int fd, const void* bytes, std::size_t size, const std::string& file) {
  const auto* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = write(fd, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throwNoMemory(file);
    next += written;
    size -= static_cast<std::size_t>(written);
  }
}

/// The list for a process of web-ifc, as read_ifc.js documents it.
std::string formatList(const IfcFilePart& part) {
  const std::uint64_t count = part.ranges.size();
  std::string list;
  const auto append = [&](const auto* values, std::size_t size) {
    list.append(reinterpret_cast<const char*>(values), size);
  };
  append(&count, sizeof count);
  append(part.ranges.data(), part.ranges.size() * sizeof part.ranges[0]);
  append(part.products.data(), part.products.size() * sizeof part.products[0]);
  return list;
}

void closeIfOpen(int& fd) {
  if (fd >= 0) close(fd);
  fd = -1;
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

double getInfiniteTimeout() {
  return std::numeric_limits<double>::infinity();
}

}  // namespace

IfcInput::IfcInput(const ImportRequest& request, std::size_t parts)
    : IfcInput(request) {  // so that the destructor runs if something below throws
  std::array<int, 2> ends{-1, -1};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throwNoMemory(request.file);
  readyDescriptor_ = moveUp(ends[0]);
  unreadyDescriptor_ = moveUp(ends[1]);
  if (readyDescriptor_ < 0 || unreadyDescriptor_ < 0) throwNoMemory(request.file);
  fileDescriptor_ = openSharedMemory(request.file);
  listDescriptor_ = openSharedMemory(request.file);
  for (std::size_t i = 0; i < parts; ++i) parts_.push_back({{}, openSharedMemory(request.file)});
}

void IfcInput::fill(const std::string& text, std::vector<std::uint32_t> wanted,
                    std::vector<IfcFilePart> parts) {
  ENFILADE_ASSERT(parts.size() <= parts_.size());
  writeShared(fileDescriptor_, text.data(), text.size(), request_.file);
  writeShared(listDescriptor_, wanted.data(), wanted.size() * sizeof wanted[0], request_.file);
  if (parts.empty()) parts.push_back({std::move(wanted), {{0, text.size()}}});
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const std::string list = formatList(parts[i]);
    writeShared(parts_[i].listDescriptor, list.data(), list.size(), request_.file);
    parts_[i].products = std::move(parts[i].products);
  }
  abandon();
}

void IfcInput::abandon() {
  if (unreadyDescriptor_ < 0) return;
  closeIfOpen(unreadyDescriptor_);
  filled_.count_down();
}

IfcInput::~IfcInput() {
  for (int* fd : {&fileDescriptor_, &listDescriptor_, &readyDescriptor_, &unreadyDescriptor_})
    closeIfOpen(*fd);
  for (Part& part : parts_) closeIfOpen(part.listDescriptor);
}

ImportRequest IfcInput::makeRequest(ImportTask task, double timeLimit) const {
  ImportRequest request = request_;
  request.task = task;
  request.options.timeLimit = timeLimit;
  request.ifcFile = fileDescriptor_;
  request.ifcProductIds = listDescriptor_;
  return request;
}

ImportRequest IfcInput::makePartRequest(std::size_t part, double timeLimit) const {
  ImportRequest request = makeRequest(ImportTask::webIfc, timeLimit);
  request.ifcProductIds = parts_[part].listDescriptor;
  request.ifcReady = readyDescriptor_;
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

/// A geometry that several parts deliver is the same in each.
void mergeResult(IfcReadResult&& from, IfcReadResult& to) {
  to.meshes.geometries.merge(from.meshes.geometries);
  to.meshes.products.merge(from.meshes.products);
  to.meshes.failures.merge(from.meshes.failures);
  if (to.failure.empty()) to.failure = std::move(from.failure);
}

}  // namespace

WebIfcReading::WebIfcReading(IfcInput& input, double timeLimit, const ImportProgress& progress)
    : input_(input), location_(findWebIfc()), progress_(progress), fractions_(input.partCount()) {
  if (!location_.missing.empty()) return;
  for (std::size_t i = 0; i < input.partCount(); ++i)  // one after another where threads are short
    readings_.push_back(std::async(std::launch::async | std::launch::deferred,
                                   [this, i, timeLimit] { return readPart(i, timeLimit); }));
}

WebIfcReading::~WebIfcReading() {
  input_.abandon();
}

void WebIfcReading::reportProgress(std::size_t part, const std::string& stage, double fraction) {
  const std::lock_guard lock(mutex_);
  fractions_[part] = fraction;
  if (progress_)
    progress_(stage, std::reduce(fractions_.begin(), fractions_.end()) /
                         static_cast<double>(fractions_.size()));
}

IfcReadResult WebIfcReading::readPart(std::size_t part, double timeLimit) {
  IfcReadResult result;
  const auto start = Clock::now();
  const std::vector<std::uint32_t>& products = input_.products(part);  // not before it is filled
  const ImportProgress progress = [&](const std::string& stage, double fraction) {
    reportProgress(part, stage, fraction);
  };
  std::uint32_t first = 0;
  for (int starts = 0; starts < kMaxStarts; ++starts) {
    const double used = std::chrono::duration<double>(Clock::now() - start).count();
    ImportRequest request = input_.makePartRequest(part, timeLimit - used);
    request.program = location_.node;
    request.script = location_.script;
    request.firstProduct = first;
    ReaderStatus status;
    const ImportExit end = runImportProcess(
        request,
        [&](ImportMessage kind, std::span<const std::byte> body) {
          input_.waitUntilFilled();  // from then on, no other thread reports progress
          return handleMessage(kind, body, progress, status, result.meshes);
        },
        [&] { return status.trying ? kProductTimeout : getInfiniteTimeout(); });
    input_.waitUntilFilled();
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

IfcReadResult WebIfcReading::finish() {
  IfcReadResult result;
  if (!location_.missing.empty()) {
    result.failure = location_.missing;
    result.notInstalled = true;
  }
  for (std::future<IfcReadResult>& reading : readings_) mergeResult(reading.get(), result);
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
      getInfiniteTimeout);
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
      getInfiniteTimeout);
  result.failure = describeFailure(status, end);
  return result;
}

}  // namespace enfilade::scene
