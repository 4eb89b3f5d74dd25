#include "scene/world/avatars/order_end.hpp"

#include <algorithm>

namespace enfilade::scene {
namespace {

void apply(const Order& order, std::optional<OrderEnd>& end) {
  if (const Walk* walk = std::get_if<Walk>(&order); walk && end) {
    end->footPosition = walk->waypoints.back();
  } else if (const Spawn* spawn = std::get_if<Spawn>(&order); spawn && !end) {
    const bool isPrism = spawn->parts.empty() && spawn->links.empty();
    end = {spawn->position, isPrism ? spawn->radius : 0, isPrism ? spawn->height : 0};
  }
}

}  // namespace

std::optional<OrderEnd> findOrderEnd(const WorldData& world, std::string_view name) {
  std::optional<OrderEnd> end;
  if (const Avatar* avatar = world.findAvatarByName(name)) {
    const bool isPrism = avatar->spawnHeight > 0 && avatar->chain.links.empty();
    end = {avatar->footPosition, isPrism ? avatar->radius : 0, isPrism ? avatar->spawnHeight : 0};
  }
  const auto queue = std::ranges::find(world.queues, name, &OrderQueue::name);
  if (queue != world.queues.end())
    for (const QueuedOrder& queued : queue->orders) apply(queued.order, end);
  for (const Command& command : world.pendingCommands)
    if (command.avatar == name) apply(command.order, end);
  return end;
}

}  // namespace enfilade::scene
