// Context and result of the execution of an order. Private to avatars/.
#pragma once

#include "scene/model/format_number.hpp"
#include "scene/world/data/tick_report.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

inline constexpr double kTimeTolerance = 1e-9;  ///< seconds: rounding of summed tick durations

/// The avatar and queue whose orders are executed, and the outputs of the tick.
struct OrderContext {
  WorldData& world;
  TickReport& report;
  QueryCount& count;
  OrderQueue& queue;

  Avatar* findAvatar() const { return world.findAvatar(queue.avatar); }
  std::uint64_t tag() const { return queue.orders.front().tag; }
  void emitNotice(Notice::Kind kind, std::string text = {}, EntityId obstacle = 0) const {
    Notice notice{kind, queue.name, 0, tag(), Vec3::Zero(), obstacle, std::move(text)};
    if (const Avatar* a = findAvatar()) notice.id = a->id, notice.position = a->footPosition;
    report.notices.push_back(std::move(notice));
  }
};

/// Status of the front order after its execution in this tick.
enum class OrderStatus : std::uint8_t {
  done,          ///< completed: the next order may start in this tick
  doneThisTick,  ///< completed, but the next order starts in the next tick
  running
};

}  // namespace enfilade::scene
