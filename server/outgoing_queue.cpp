#include "server/outgoing_queue.hpp"

#include "protocol/framing.hpp"

namespace enfilade::server {

Buffer encodeShared(const google::protobuf::MessageLite& message,
                    std::span<const std::uint8_t> attachment) {
  return std::make_shared<const std::vector<std::uint8_t>>(protocol::encode(message, attachment));
}

OutgoingQueue::OutgoingQueue(const OutgoingBounds& bounds, Buffer tooSlow,
                             std::function<void()> wake)
    : bounds_(bounds), tooSlow_(std::move(tooSlow)), wake_(std::move(wake)) {}

void OutgoingQueue::push(Buffer message) {
  append(Kind::kept, std::move(message));
}

void OutgoingQueue::pushFrame(Buffer message) {
  append(Kind::frame, std::move(message));
}

void OutgoingQueue::pushLatest(Buffer message) {
  append(Kind::latest, std::move(message));
}

void OutgoingQueue::finish(Buffer last) {
  append(Kind::last, std::move(last));
}

void OutgoingQueue::append(Kind kind, Buffer message) {
  {
    const std::lock_guard lock(mutex_);
    if (finished_) return;
    if (kind == Kind::kept) bytes_ += message->size();
    if (kind == Kind::frame) ++frames_;
    items_.push_back({kind, std::move(message)});
    finished_ = kind == Kind::last;
    if (bytes_ > bounds_.bytes || frames_ > bounds_.frames) {
      overflowed_ = finished_ = true;
      items_.assign(1, {Kind::last, tooSlow_});
    }
  }
  wake_();
}

bool OutgoingQueue::dropLatest() {
  const std::lock_guard lock(mutex_);
  return std::erase_if(items_, [](const Item& item) { return item.kind == Kind::latest; }) > 0;
}

OutgoingQueue::Next OutgoingQueue::pop() {
  const std::lock_guard lock(mutex_);
  if (items_.empty()) return {};
  Item item = std::move(items_.front());
  items_.pop_front();
  if (item.kind == Kind::kept) bytes_ -= item.message->size();
  if (item.kind == Kind::frame) --frames_;
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
