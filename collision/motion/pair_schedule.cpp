// Binary heap of slots. Each slot stores its heap index, so a key change costs O(log n).
#include "collision/motion/pair_schedule.hpp"

#include <cmath>
#include <stdexcept>

#include "collision/assert.hpp"

namespace enfilade::collision {

void PairSchedule::set(std::uint32_t a, std::uint32_t b, double time) {
  if (a == b) throw std::invalid_argument("the two bodies of a pair must differ");
  if (std::isnan(time)) throw std::invalid_argument("the check time of a pair is NaN");
  if (const auto found = slotByPair_.find({a, b}); found != slotByPair_.end()) {
    slots_[found->second].entry.time = time;
    return restoreHeapOrder(found->second);
  }
  if (freeSlots_.empty()) {
    freeSlots_.push_back(static_cast<std::uint32_t>(slots_.size()));
    slots_.emplace_back();
  }
  const std::uint32_t slot = freeSlots_.back();
  freeSlots_.pop_back();
  slots_[slot].entry = {time, makePair(a, b)};
  slotByPair_[{a, b}] = slot;
  slotByPair_[{b, a}] = slot;
  heap_.push_back(slot);
  placeSlot(heap_.size() - 1, slot);
  siftUp(heap_.size() - 1);
}

bool PairSchedule::remove(std::uint32_t a, std::uint32_t b) {
  const auto found = slotByPair_.find({a, b});
  if (found == slotByPair_.end()) return false;
  removeSlot(found->second);
  return true;
}

void PairSchedule::scheduleBodyNow(std::uint32_t body, double now) {
  for (const std::uint32_t slot : findSlots(body)) {
    double& time = slots_[slot].entry.time;
    if (!(time > now)) continue;
    time = now;
    restoreHeapOrder(slot);
  }
}

std::optional<double> PairSchedule::findTime(std::uint32_t a, std::uint32_t b) const {
  const auto found = slotByPair_.find({a, b});
  if (found == slotByPair_.end()) return std::nullopt;
  return slots_[found->second].entry.time;
}

std::vector<PairSchedule::Entry> PairSchedule::findEntries(std::uint32_t body) const {
  std::vector<Entry> entries;
  for (const std::uint32_t slot : findSlots(body)) entries.push_back(slots_[slot].entry);
  return entries;
}

std::optional<PairSchedule::Entry> PairSchedule::popDue(double now) {
  if (heap_.empty() || slots_[heap_.front()].entry.time > now) return std::nullopt;
  const Entry first = slots_[heap_.front()].entry;
  removeSlot(heap_.front());
  return first;
}

bool PairSchedule::isBefore(std::uint32_t p, std::uint32_t q) const {
  const Entry& first = slots_[p].entry;
  const Entry& second = slots_[q].entry;
  return first.time != second.time ? first.time < second.time : first.pair < second.pair;
}

void PairSchedule::placeSlot(std::size_t index, std::uint32_t slot) {
  ENFILADE_ASSERT(index < heap_.size() && slot < slots_.size());
  heap_[index] = slot;
  slots_[slot].heapIndex = index;
}

void PairSchedule::siftUp(std::size_t index) {
  const std::uint32_t slot = heap_[index];
  while (index > 0 && isBefore(slot, heap_[(index - 1) / 2])) {
    placeSlot(index, heap_[(index - 1) / 2]);
    index = (index - 1) / 2;
  }
  placeSlot(index, slot);
}

void PairSchedule::siftDown(std::size_t index) {
  const std::uint32_t slot = heap_[index];
  while (2 * index + 1 < heap_.size()) {
    std::size_t child = 2 * index + 1;
    if (child + 1 < heap_.size() && isBefore(heap_[child + 1], heap_[child])) ++child;
    if (!isBefore(heap_[child], slot)) break;
    placeSlot(index, heap_[child]);
    index = child;
  }
  placeSlot(index, slot);
}

/// Restores the heap order after a change of the slot's time.
void PairSchedule::restoreHeapOrder(std::uint32_t slot) {
  siftUp(slots_[slot].heapIndex);
  siftDown(slots_[slot].heapIndex);
}

void PairSchedule::removeSlot(std::uint32_t slot) {
  const auto [a, b] = slots_[slot].entry.pair;
  slotByPair_.erase({a, b});
  slotByPair_.erase({b, a});
  freeSlots_.push_back(slot);
  const std::size_t index = slots_[slot].heapIndex;
  ENFILADE_ASSERT(index < heap_.size() && heap_[index] == slot);
  const std::uint32_t last = heap_.back();
  heap_.pop_back();
  if (last == slot) return;
  placeSlot(index, last);
  restoreHeapOrder(last);
}

std::vector<std::uint32_t> PairSchedule::findSlots(std::uint32_t body) const {
  std::vector<std::uint32_t> slots;
  for (auto it = slotByPair_.lower_bound({body, 0});
       it != slotByPair_.end() && it->first.first == body; ++it)
    slots.push_back(it->second);
  return slots;
}

void PairSchedule::validate() const {
  if (slotByPair_.size() != 2 * heap_.size())
    throw std::logic_error("pairs and entries differ in number");
  for (std::size_t index = 0; index < heap_.size(); ++index) {
    if (slots_[heap_[index]].heapIndex != index) throw std::logic_error("slot: wrong heap index");
    if (index > 0 && isBefore(heap_[index], heap_[(index - 1) / 2]))
      throw std::logic_error("an entry is below a later one");
  }
}

}  // namespace enfilade::collision
