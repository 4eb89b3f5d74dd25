#include "server/messages/outgoing_queue.hpp"

#include "protocol/framing.hpp"

namespace enfilade::server {

Buffer encodeShared(const google::protobuf::MessageLite& message) {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::encode(message));
}

Encoded encodeShared(const google::protobuf::MessageLite& message,
                     std::vector<std::uint8_t> attachment) {
  using Bytes = const std::vector<std::uint8_t>;
  auto head = std::make_shared<Bytes>(protocol::encodeHead(message, attachment.size()));
  return {std::move(head), std::make_shared<Bytes>(std::move(attachment))};
}

OutgoingQueue::OutgoingQueue(const OutgoingBounds& bounds, Encoded tooSlow,
                             std::function<void()> wake)
    : bounds_(bounds), tooSlow_(std::move(tooSlow)), wake_(std::move(wake)) {}

void OutgoingQueue::push(Encoded message) {
  append({Kind::kept, std::move(message)});
}

void OutgoingQueue::pushFrame(Encoded message) {
  append({Kind::frame, std::move(message)});
}

void OutgoingQueue::pushLatest(Encoded message, std::uint32_t which) {
  append({Kind::latest, std::move(message), which});
}

void OutgoingQueue::finish(Encoded last) {
  append({Kind::last, std::move(last)});
}

void OutgoingQueue::append(Item item) {
  {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    if (item.kind == Kind::kept) bytes_ += item.message.size();
    if (item.kind == Kind::frame) {
      ++frames_;
      frameBytes_ += item.message.size();
    }
    finished_ = item.kind == Kind::last;
    items_.push_back(std::move(item));
    // One picture alone may be as large as it likes: its size has a limit of its own.
    const bool framesTooLarge = frames_ > 1 && frameBytes_ > bounds_.frameBytes;
    if (bytes_ > bounds_.bytes || frames_ > bounds_.frames || framesTooLarge) {
      overflowed_ = finished_ = true;
      items_.assign(1, {Kind::last, tooSlow_});
    }
  }
  wake_();
}

bool OutgoingQueue::dropLatest(std::uint32_t which) {
  const std::lock_guard lock(mutex_);
  return std::erase_if(items_, [&](const Item& item) {
           return item.kind == Kind::latest && item.which == which;
         }) > 0;
}

OutgoingQueue::Next OutgoingQueue::pop() {
  const std::lock_guard lock(mutex_);
  if (items_.empty()) return {};
  Item item = std::move(items_.front());
  items_.pop_front();
  if (item.kind == Kind::kept) bytes_ -= item.message.size();
  if (item.kind == Kind::frame) {
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
