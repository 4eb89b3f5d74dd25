#include "server/messages/outgoing_queue.hpp"

#include "collision/assert.hpp"
#include "protocol/framing.hpp"

namespace enfilade::server {

Buffer encodeShared(const google::protobuf::MessageLite& message) {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::encode(message));
}

EncodedMessage encodeShared(const google::protobuf::MessageLite& message,
                            std::vector<std::uint8_t> attachment) {
  using Bytes = const std::vector<std::uint8_t>;
  auto head = std::make_shared<Bytes>(protocol::encodeHead(message, attachment.size()));
  return {std::move(head), std::make_shared<Bytes>(std::move(attachment))};
}

OutgoingQueue::OutgoingQueue(const OutgoingLimits& limits, EncodedMessage overflowMessage,
                             std::function<void()> wake)
    : limits_(limits), overflowMessage_(std::move(overflowMessage)), wake_(std::move(wake)) {}

OutgoingQueue::~OutgoingQueue() {
  removeBytes(bytes_);
}

void OutgoingQueue::addBytes(std::size_t count) {
  bytes_ += count;
  if (limits_.budget) limits_.budget->bytes += count;
}

void OutgoingQueue::removeBytes(std::size_t count) {
  ENFILADE_ASSERT(bytes_ >= count);
  bytes_ -= count;
  if (limits_.budget) limits_.budget->bytes -= count;
}

void OutgoingQueue::push(EncodedMessage message) {
  append({Kind::reliable, std::move(message)});
}

void OutgoingQueue::pushFrame(EncodedMessage message) {
  append({Kind::frame, std::move(message)});
}

void OutgoingQueue::pushLatest(EncodedMessage message, std::uint32_t slot) {
  append({Kind::latest, std::move(message), slot});
}

void OutgoingQueue::finish(EncodedMessage last) {
  append({Kind::last, std::move(last)});
}

void OutgoingQueue::append(Item item) {
  {
    const std::lock_guard lock(mutex_);
    ENFILADE_ASSERT(item.message);  // pop() returns an empty message when the queue is empty
    if (finished_) return;
    if (item.kind == Kind::reliable) addBytes(item.message.size());
    if (item.kind == Kind::frame) {
      ++frames_;
      frameBytes_ += item.message.size();
    }
    finished_ = item.kind == Kind::last;
    items_.push_back(std::move(item));
    // A single frame may exceed frameBytes: its size has a limit of its own.
    const bool framesTooLarge = frames_ > 1 && frameBytes_ > limits_.frameBytes;
    const bool exceedsBudget =
        limits_.budget && bytes_ > 0 && limits_.budget->bytes > limits_.budget->maxBytes;
    if (exceedsBudget || bytes_ > limits_.bytes || frames_ > limits_.frames || framesTooLarge) {
      overflowed_ = finished_ = true;
      items_.assign(1, {Kind::last, overflowMessage_});
      removeBytes(bytes_);
    }
  }
  wake_();
}

bool OutgoingQueue::dropLatest(std::uint32_t slot) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(items_, [&](const Item& item) {
           return item.kind == Kind::latest && item.slot == slot;
         }) > 0;
}

OutgoingQueue::Next OutgoingQueue::pop() {
  const std::lock_guard lock(mutex_);
  if (items_.empty()) return {};
  Item item = std::move(items_.front());
  items_.pop_front();
  ENFILADE_ASSERT(item.kind != Kind::last || (finished_ && items_.empty()));
  if (item.kind == Kind::reliable) removeBytes(item.message.size());
  if (item.kind == Kind::frame) {
    ENFILADE_ASSERT(frames_ > 0 && frameBytes_ >= item.message.size());
    --frames_;
    frameBytes_ -= item.message.size();
  }
  return {std::move(item.message), item.kind == Kind::last};
}

bool OutgoingQueue::finished() const {
  const std::lock_guard lock(mutex_);
  return finished_;
}

bool OutgoingQueue::overflowed() const {
  const std::lock_guard lock(mutex_);
  return overflowed_;
}

}  // namespace enfilade::server
