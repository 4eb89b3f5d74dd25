// What waits to be sent to one client. Replies and events are never dropped: when they would exceed
// the bound, the client is too slow and gets last words instead. Of what is latest-only, a newer
// one takes the place of an unsent older one. Callable from any thread.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace google::protobuf {
class MessageLite;
}

namespace enfilade::server {

using Buffer = std::shared_ptr<const std::vector<std::uint8_t>>;

/// One encoded message in two pieces, so that neither pixels nor what hundreds receive are copied
/// for each of them. Both are shared by all who receive them.
struct Encoded {
  Encoded() = default;
  Encoded(Buffer whole) : head(std::move(whole)) {}
  Encoded(Buffer first, Buffer second) : head(std::move(first)), rest(std::move(second)) {}

  Buffer head;  ///< null: no message
  Buffer rest;  ///< may be null
  std::size_t size() const { return (head ? head->size() : 0) + (rest ? rest->size() : 0); }
  explicit operator bool() const { return head != nullptr; }
};

Buffer encodeShared(const google::protobuf::MessageLite& message);
Encoded encodeShared(const google::protobuf::MessageLite& message,
                     std::vector<std::uint8_t> attachment);

struct OutgoingBounds {
  std::size_t bytes = 0;   ///< of unsent replies and events, pictures not counted
  std::size_t frames = 0;  ///< unsent pictures that were asked for
  std::size_t frameBytes = std::numeric_limits<std::size_t>::max();  ///< of those
};

class OutgoingQueue {
 public:
  /// `tooSlow` are the last words above the bounds. `wake` is called, without the lock, whenever
  /// there is something to send.
  OutgoingQueue(const OutgoingBounds& bounds, Encoded tooSlow, std::function<void()> wake);

  void push(Encoded message);
  void pushFrame(Encoded message);
  /// What is latest-only has a number that tells which of them it is.
  void pushLatest(Encoded message, std::uint32_t which = 0);
  /// Drops the unsent latest-only message of this number; true when there was one.
  bool dropLatest(std::uint32_t which = 0);
  /// Sends what is queued, then `last`, then the connection closes. Later pushes are dropped.
  void finish(Encoded last);

  struct Next {
    Encoded message;    ///< none: nothing to send
    bool last = false;  ///< close after this one
  };
  Next pop();

  bool finished() const;    ///< its last words are queued or sent
  bool overflowed() const;  ///< finished because the client is too slow

 private:
  enum class Kind : std::uint8_t { kept, frame, latest, last };
  struct Item {
    Kind kind;
    Encoded message;
    std::uint32_t which = 0;  ///< of what is latest-only
  };
  void append(Item item);

  const OutgoingBounds bounds_;
  const Encoded tooSlow_;
  const std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::deque<Item> items_;
  std::size_t bytes_ = 0, frames_ = 0, frameBytes_ = 0;
  bool finished_ = false, overflowed_ = false;
};

}  // namespace enfilade::server
