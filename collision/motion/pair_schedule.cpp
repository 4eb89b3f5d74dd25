// A binary heap of slots; a slot knows its place in the heap, so that a key is changed in O(log n).
#include "collision/motion/pair_schedule.hpp"

#include <cmath>
#include <stdexcept>

namespace enfilade::collision {
namespace {

WakeUpHeap::BodyPair ordered(std::uint32_t a, std::uint32_t b) {
  return a < b ? WakeUpHeap::BodyPair{a, b} : WakeUpHeap::BodyPair{b, a};
}

}  // namespace

void WakeUpHeap::set(std::uint32_t a, std::uint32_t b, double time) {
  if (a == b) throw std::invalid_argument("a body makes no pair with itself");
  if (std::isnan(time)) throw std::invalid_argument("a wake-up time is no number");
  if (const auto found = slotOf_.find({a, b}); found != slotOf_.end()) {
    slots_[found->second].entry.time = time;
    return settle(found->second);
  }
  if (unused_.empty()) {
    unused_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t slot = unused_.back();
  unused_.pop_back();
  slots_[slot].entry = {time, ordered(a, b)};
  slotOf_[{a, b}] = slot;
  slotOf_[{b, a}] = slot;
  heap_.push_back(slot);
  put(heap_.size() - 1, slot);
  rise(heap_.size() - 1);
}

bool WakeUpHeap::remove(std::uint32_t a, std::uint32_t b) {
  const auto found = slotOf_.find({a, b});
  if (found == slotOf_.end()) return false;
  take(found->second);
  return true;
}

void WakeUpHeap::removeBody(std::uint32_t body) {
  for (const std::uint32_t slot : slotsOf(body)) take(slot);
}

void WakeUpHeap::wakeBody(std::uint32_t body, double now) {
  for (const std::uint32_t slot : slotsOf(body)) {
    double& time = slots_[slot].entry.time;
    if (!(time > now)) continue;
    time = now;
    settle(slot);
  }
}

std::optional<double> WakeUpHeap::timeOf(std::uint32_t a, std::uint32_t b) const {
  const auto found = slotOf_.find({a, b});
  if (found == slotOf_.end()) return std::nullopt;
  return slots_[found->second].entry.time;
}

std::optional<WakeUpHeap::Entry> WakeUpHeap::earliest() const {
  if (heap_.empty()) return std::nullopt;
  return slots_[heap_.front()].entry;
}

std::optional<WakeUpHeap::Entry> WakeUpHeap::popDue(double now) {
  const std::optional<Entry> first = earliest();
  if (!first || first->time > now) return std::nullopt;
  take(heap_.front());
  return first;
}

bool WakeUpHeap::before(std::uint32_t p, std::uint32_t q) const {
  const Entry& first = slots_[p].entry;
  const Entry& second = slots_[q].entry;
  return first.time != second.time ? first.time < second.time : first.pair < second.pair;
}

void WakeUpHeap::put(std::size_t place, std::uint32_t slot) {
  heap_[place] = slot;
  slots_[slot].place = place;
}

void WakeUpHeap::rise(std::size_t place) {
  const std::uint32_t slot = heap_[place];
  while (place > 0 && before(slot, heap_[(place - 1) / 2])) {
    put(place, heap_[(place - 1) / 2]);
    place = (place - 1) / 2;
  }
  put(place, slot);
}

void WakeUpHeap::sink(std::size_t place) {
  const std::uint32_t slot = heap_[place];
  while (2 * place + 1 < heap_.size()) {
    std::size_t child = 2 * place + 1;
    if (child + 1 < heap_.size() && before(heap_[child + 1], heap_[child])) ++child;
    if (!before(heap_[child], slot)) break;
    put(place, heap_[child]);
    place = child;
  }
  put(place, slot);
}

/// After its time has changed.
void WakeUpHeap::settle(std::uint32_t slot) {
  rise(slots_[slot].place);
  sink(slots_[slot].place);
}

void WakeUpHeap::take(std::uint32_t slot) {
  const auto [a, b] = slots_[slot].entry.pair;
  slotOf_.erase({a, b});
  slotOf_.erase({b, a});
  unused_.push_back(slot);
  const std::size_t place = slots_[slot].place;
  const std::uint32_t last = heap_.back();
  heap_.pop_back();
  if (last == slot) return;
  put(place, last);
  settle(last);
}

std::vector<std::uint32_t> WakeUpHeap::slotsOf(std::uint32_t body) const {
  std::vector<std::uint32_t> slots;
  for (auto it = slotOf_.lower_bound({body, 0}); it != slotOf_.end() && it->first.first == body;
       ++it)
    slots.push_back(it->second);
  return slots;
}

void WakeUpHeap::validate() const {
  if (slotOf_.size() != 2 * heap_.size())
    throw std::logic_error("pairs and entries differ in number");
  for (std::size_t place = 0; place < heap_.size(); ++place) {
    if (slots_[heap_[place]].place != place) throw std::logic_error("a slot has lost its place");
    if (place > 0 && before(heap_[place], heap_[(place - 1) / 2]))
      throw std::logic_error("an entry stands after a later one");
  }
}

}  // namespace enfilade::collision
