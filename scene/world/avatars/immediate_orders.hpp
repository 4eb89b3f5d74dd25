// Execution of the orders Jump, Fly, Crouch and DriveJoints.
#pragma once

#include "scene/world/avatars/order_context.hpp"

namespace enfilade::scene {

OrderStatus executeOrder(const Jump& jump, OrderContext& context);
OrderStatus executeOrder(const Fly& fly, OrderContext& context);
OrderStatus executeOrder(const Crouch& crouch, OrderContext& context);
OrderStatus executeOrder(const DriveJoints& drive, OrderContext& context);

}  // namespace enfilade::scene
