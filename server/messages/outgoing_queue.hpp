// Queue of messages to one client. Replies and events are never dropped: if they exceed the limit,
// the client is too slow and gets a final message instead. Latest-only messages (states, subscribed
// frames) can be withdrawn before they are sent. Callable from any thread.
#pragma once

#include <atomic>
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

/// An encoded message in two shared pieces. Neither pixels nor broadcast events are copied for each
/// receiver.
struct EncodedMessage {
  EncodedMessage() = default;
  EncodedMessage(Buffer whole) : head(std::move(whole)) {}
  EncodedMessage(Buffer first, Buffer second) : head(std::move(first)), body(std::move(second)) {}

  Buffer head;  ///< null: no message
  Buffer body;  ///< may be null
  std::size_t size() const { return (head ? head->size() : 0) + (body ? body->size() : 0); }
  explicit operator bool() const { return head != nullptr; }
};

Buffer encodeShared(const google::protobuf::MessageLite& message);
EncodedMessage encodeShared(const google::protobuf::MessageLite& message,
                            std::vector<std::uint8_t> attachment);

/// Unsent replies and events of all clients of a server.
struct OutgoingBudget {
  explicit OutgoingBudget(std::size_t limit) : maxBytes(limit) {}
  const std::size_t maxBytes;
  std::atomic<std::size_t> bytes{0};
};

struct OutgoingLimits {
  std::size_t bytes = 0;   ///< of unsent replies and events, without frames
  std::size_t frames = 0;  ///< unsent requested frames
  std::size_t frameBytes = std::numeric_limits<std::size_t>::max();  ///< of these frames
  /// Shared by all clients: the one whose message exceeds it is too slow. Null: no such limit.
  std::shared_ptr<OutgoingBudget> budget = nullptr;
};

class OutgoingQueue {
 public:
  /// `overflowMessage` is the final message when the limits are exceeded. `wake` is called, without
  /// the lock, after each queued message.
  OutgoingQueue(const OutgoingLimits& limits, EncodedMessage overflowMessage,
                std::function<void()> wake);
  ~OutgoingQueue();
  OutgoingQueue(const OutgoingQueue&) = delete;
  OutgoingQueue& operator=(const OutgoingQueue&) = delete;

  void push(EncodedMessage message);
  void pushFrame(EncodedMessage message);
  /// `slot` identifies the stream of a latest-only message.
  void pushLatest(EncodedMessage message, std::uint32_t slot = 0);
  /// Drops the unsent latest-only messages of `slot`; returns whether there were any.
  bool dropLatest(std::uint32_t slot = 0);
  /// Sends the queued messages, then `last`; then the connection closes. Later pushes are dropped.
  void finish(EncodedMessage last);

  struct Next {
    EncodedMessage message;  ///< empty: nothing to send
    bool last = false;       ///< close after this message
  };
  Next pop();

  bool finished() const;    ///< the final message is queued or sent
  bool overflowed() const;  ///< the client is too slow

 private:
  enum class Kind : std::uint8_t { reliable, frame, latest, last };
  struct Item {
    Kind kind;
    EncodedMessage message;
    std::uint32_t slot = 0;  ///< of a latest-only message
  };
  void append(Item item);
  void addBytes(std::size_t count);
  void removeBytes(std::size_t count);

  const OutgoingLimits limits_;
  const EncodedMessage overflowMessage_;
  const std::function<void()> wake_;
  mutable std::mutex mutex_;
  std::deque<Item> items_;
  std::size_t bytes_ = 0, frames_ = 0, frameBytes_ = 0;
  bool finished_ = false, overflowed_ = false;
};

}  // namespace enfilade::server
