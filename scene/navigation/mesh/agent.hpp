// NavigationAgent: size and speed of an agent, an upright prism without parts and links.
#pragma once

namespace enfilade::scene {

struct NavigationAgent {
  double radius = 0.3;   ///< metres, as Spawn::radius
  double height = 1.75;  ///< metres, as Spawn::height
  double speed = 1.4;    ///< metres per second, as Walk::speed

  bool operator==(const NavigationAgent&) const = default;
};

}  // namespace enfilade::scene
