#include "collision/motion/pair_schedule.hpp"

#include <cmath>
#include <stdexcept>

namespace enfilade::collision {
namespace {

PairSchedule::BodyPair makeOrderedPair(std::uint32_t a, std::uint32_t b) {
  return a < b ? PairSchedule::BodyPair{a, b} : PairSchedule::BodyPair{b, a};
}

}  // namespace

void PairSchedule::set(std::uint32_t a, std::uint32_t b, double time) {
  if (a == b) throw std::invalid_argument("the two bodies of a pair must differ");
  if (std::isnan(time)) throw std::invalid_argument("the check time of a pair is NaN");
  if (const auto known = findTime(a, b)) queue_.erase({*known, makeOrderedPair(a, b)});
  times_[{a, b}] = times_[{b, a}] = time;
  queue_.insert({time, makeOrderedPair(a, b)});
}

bool PairSchedule::remove(std::uint32_t a, std::uint32_t b) {
  const auto known = findTime(a, b);
  if (!known) return false;
  queue_.erase({*known, makeOrderedPair(a, b)});
  times_.erase({a, b});
  times_.erase({b, a});
  return true;
}

void PairSchedule::scheduleBodyNow(std::uint32_t body, double now) {
  for (const auto& [time, pair] : findEntries(body))
    if (time > now) set(pair.first, pair.second, now);
}

std::optional<double> PairSchedule::findTime(std::uint32_t a, std::uint32_t b) const {
  const auto found = times_.find({a, b});
  return found == times_.end() ? std::nullopt : std::optional(found->second);
}

std::vector<PairSchedule::Entry> PairSchedule::findEntries(std::uint32_t body) const {
  std::vector<Entry> entries;
  for (auto it = times_.lower_bound({body, 0}); it != times_.end() && it->first.first == body; ++it)
    entries.push_back({it->second, makeOrderedPair(body, it->first.second)});
  return entries;
}

std::optional<PairSchedule::Entry> PairSchedule::popDue(double now) {
  if (queue_.empty() || queue_.begin()->time > now) return std::nullopt;
  const Entry first = *queue_.begin();
  remove(first.pair.first, first.pair.second);
  return first;
}

void PairSchedule::validate() const {
  if (times_.size() != 2 * queue_.size())
    throw std::logic_error("pairs and entries differ in number");
  for (const auto& [bodies, time] : times_)
    if (!queue_.contains({time, makeOrderedPair(bodies.first, bodies.second)}))
      throw std::logic_error("a pair has no entry at its time");
}

}  // namespace enfilade::collision
