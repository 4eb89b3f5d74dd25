// A copy of the movers as they were between two ticks. Pairs follow from boxes, and are told in the
// order of ids: boxes and ids are all that a copy needs. (How cells were laid changes no pair.)
#include <algorithm>
#include <stdexcept>

#include "collision/broad_phase/sort_and_sweep_state.hpp"

namespace enfilade::collision {
namespace {

Box boxOfReach(const HalfAxes& r) {
  return {Vec3(-r[0], -r[1], -r[2]), Vec3(r[3], r[4], r[5])};
}

/// Each id below the number of all is there once: in use, leaving, or free.
void requireRoll(std::span<const std::pair<MoverId, Box>> there, const SortAndSweep::Roll& roll) {
  std::vector<MoverId> ids(roll.free);
  for (const auto& [id, box] : there) ids.push_back(id);
  for (const auto& [id, box] : roll.leaving) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (ids[i] != i) throw std::invalid_argument("ids of movers are lacking, or given twice");
}

}  // namespace

SortAndSweep::Roll SortAndSweep::roll() const {
  const State& s = *state_;
  Roll roll{s.freeIds, {}, s.tick > 0};
  for (const MoverId id : s.leaving) roll.leaving.emplace_back(id, boxOfReach(s.reaches[id]));
  return roll;
}

void SortAndSweep::restore(std::span<const std::pair<MoverId, Box>> there, const Roll& roll) {
  State& s = *state_;
  if (s.tick > 0) throw std::invalid_argument("movers are restored before the first update");
  requireRoll(there, roll);
  std::vector<std::pair<MoverId, Box>> all(there.begin(), there.end());
  all.insert(all.end(), roll.leaving.begin(), roll.leaving.end());
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.first < b.first; });

  const std::size_t count = all.size() + roll.free.size();
  s.movers.clear();
  s.movers.resize(count);
  s.reaches.assign(count, {});
  s.isStirred.assign(count, 0);
  s.fresh.clear();
  s.freeIds.clear();
  for (const auto& [id, box] : all) {  // insert() gives the id that was freed last
    s.freeIds.push_back(id);
    insert(box);
  }
  s.freeIds = roll.free;
  if (!roll.updated) return;
  update();
  s.begun.clear();
  for (const auto& [id, box] : roll.leaving) remove(id);
}

}  // namespace enfilade::collision
