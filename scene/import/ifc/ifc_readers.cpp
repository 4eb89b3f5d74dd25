#include "scene/import/ifc/ifc_readers.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <limits>

#include "scene/import/ifc/web_ifc.hpp"
#include "scene/import/worker/model_stream.hpp"

namespace enfilade::scene {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kMostStarts = 8;           // of web-ifc for one file: each start reads the file again
constexpr double kPatience = 20;         // seconds that web-ifc may spend on one product
constexpr int kFirstOwnDescriptor = 10;  // above those that an importing process expects

/// `bytes` in memory that has a file descriptor.
int sharedMemory(const void* bytes, std::size_t size, const std::string& file) {
  const auto fail = [&] {
    throw ImportError(file + ": no memory to hand the file to its reader: " + std::strerror(errno) +
                      " (start)");
  };
  const int low = memfd_create("enfilade-ifc", MFD_CLOEXEC);
  if (low < 0) fail();
  const int fd = fcntl(low, F_DUPFD_CLOEXEC, kFirstOwnDescriptor);
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

/// What a reader has told so far.
struct Hearing {
  std::string stage = "start";
  std::string error;
  bool done = false;
  std::optional<std::uint32_t> trying;
};

std::string textOf(std::span<const std::byte> body) {
  return {reinterpret_cast<const char*>(body.data()), body.size()};
}

bool hear(ImportFrame kind, std::span<const std::byte> body, const ImportProgress& progress,
          Hearing& hearing, IfcShapes& shapes) {
  double fraction = 0;
  std::uint32_t index = 0;
  switch (kind) {
    case ImportFrame::progress:
      if (!readProgress(body, hearing.stage, fraction)) return false;
      if (progress) progress(hearing.stage, fraction);
      return true;
    case ImportFrame::error:
      hearing.error = textOf(body);
      return true;
    case ImportFrame::done:
      hearing.done = true;
      return true;
    case ImportFrame::trying:
      if (body.size() != sizeof index) return false;
      std::memcpy(&index, body.data(), sizeof index);
      hearing.trying = index;
      return true;
    default:
      return takeShapes(kind, body, shapes);
  }
}

/// Why a reader ended before the end; empty: it did not.
std::string failureOf(const Hearing& hearing, const ImportEnd& end) {
  if (hearing.done) return {};
  if (!hearing.error.empty()) return hearing.error;
  return end.words() + " during '" + hearing.stage + "'";
}

double forever() {
  return std::numeric_limits<double>::infinity();
}

}  // namespace

IfcInput::IfcInput(const ImportRequest& request, const std::string& text,
                   std::vector<std::uint32_t> wanted)
    : request_(request), wanted_(std::move(wanted)) {
  file_ = sharedMemory(text.data(), text.size(), request.file);
  list_ = sharedMemory(wanted_.data(), wanted_.size() * sizeof wanted_[0], request.file);
}

IfcInput::~IfcInput() {
  close(file_);
  close(list_);
}

ImportRequest IfcInput::requestFor(ImportTask task, double timeLimit) const {
  ImportRequest request = request_;
  request.task = task;
  request.timeLimit = timeLimit;
  request.ifcFile = file_;
  request.ifcWanted = list_;
  return request;
}

namespace {

/// What was never tried is no product of which nothing was left.
void giveUpFrom(std::size_t first, const std::vector<std::uint32_t>& wanted, IfcReading& reading) {
  for (std::size_t i = first; i < wanted.size(); ++i)
    if (!reading.shapes.products.contains(wanted[i]))
      reading.shapes.failures.try_emplace(wanted[i], "not tried: web-ifc " + reading.failure);
}

}  // namespace

IfcReading readByWebIfc(const IfcInput& input, double timeLimit, const ImportProgress& progress) {
  IfcReading reading;
  const WebIfcPlace place = findWebIfc();
  if (!place.missing.empty()) {
    reading.failure = place.missing;
    reading.absent = true;
    return reading;
  }
  const auto start = Clock::now();
  std::uint32_t first = 0;
  for (int starts = 0; starts < kMostStarts; ++starts) {
    const double used = std::chrono::duration<double>(Clock::now() - start).count();
    ImportRequest request = input.requestFor(ImportTask::webIfc, timeLimit - used);
    request.program = place.node;
    request.script = place.script;
    request.firstProduct = first;
    Hearing hearing;
    const ImportEnd end = runImportProcess(
        request,
        [&](ImportFrame kind, std::span<const std::byte> body) {
          return hear(kind, body, progress, hearing, reading.shapes);
        },
        [&] { return hearing.trying ? kPatience : forever(); });
    reading.failure = failureOf(hearing, end);
    const bool overOne = hearing.trying && *hearing.trying < input.wanted().size();
    if (hearing.done) return reading;
    if (!overOne || end.how == ImportEnd::How::timeLimit) {
      giveUpFrom(hearing.trying.value_or(first), input.wanted(), reading);
      return reading;
    }
    // One product brought it down: leave that one out, keep what it has of the others.
    const std::uint32_t culprit = input.wanted()[*hearing.trying];
    reading.shapes.products.erase(culprit);
    reading.shapes.failures.try_emplace(culprit, "web-ifc " + reading.failure);
    first = *hearing.trying + 1;
  }
  giveUpFrom(first, input.wanted(), reading);
  return reading;
}

IfcReading readByIfcPlusPlus(const IfcInput& input, double timeLimit,
                             const ImportProgress& progress) {
  IfcReading reading;
  Hearing hearing;
  const ImportEnd end = runImportProcess(
      input.requestFor(ImportTask::ifcPlusPlus, timeLimit),
      [&](ImportFrame kind, std::span<const std::byte> body) {
        return hear(kind, body, progress, hearing, reading.shapes);
      },
      forever);
  reading.failure = failureOf(hearing, end);
  return reading;
}

AssimpReading readIfcByAssimp(const IfcInput& input, double timeLimit,
                              const ImportProgress& progress) {
  AssimpReading reading;
  Hearing hearing;
  IfcShapes none;
  const ImportEnd end = runImportProcess(
      input.requestFor(ImportTask::assimp, timeLimit),
      [&](ImportFrame kind, std::span<const std::byte> body) {
        if (kind != ImportFrame::model) return hear(kind, body, progress, hearing, none);
        try {
          reading.model = deserialiseModel(body);
        } catch (const ModelStreamError&) {
          return false;
        }
        return hearing.done = true;
      },
      forever);
  reading.failure = failureOf(hearing, end);
  return reading;
}

}  // namespace enfilade::scene
