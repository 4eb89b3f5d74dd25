// Turns an avatar about the vertical axis through its feet.
#pragma once

#include "scene/world/avatars/order_context.hpp"

namespace enfilade::scene {

/// Starts, continues or ends the order; turnAvatar() makes the motion.
OrderStatus executeOrder(const Turn& turn, OrderContext& context);

/// Bound on the displacement of any point by turnAvatar(), metres.
double computeMaxTurnDisplacement(const WorldSettings& settings, const Avatar& avatar);

/// Turns the view, the parts and the links of an avatar for one tick, up to the first obstacle.
void turnAvatar(const WorldSettings& settings, Avatar& avatar, QueryCount& count);

/// Turns the view to a facing and keeps its elevation.
void setViewFacing(Avatar& avatar, double degrees);

}  // namespace enfilade::scene
