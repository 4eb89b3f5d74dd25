// Orders and ticks of the fixtures that have a `world` and step().
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "scene/world/world.hpp"

namespace enfilade::scene::testing {

template <class Fixture>
class WorldControls {
 public:
  void order(const std::string& name, Order o) {
    const auto why = submitAvatarCommand(getFixture().world, {name, std::move(o), 0});
    ASSERT_FALSE(why) << *why;
  }
  void runTicks(int count) {
    for (int i = 0; i < count; ++i) getFixture().step();
  }
  /// Steps until every queue is empty; fails after a simulated minute.
  void runUntilIdle() {
    for (int i = 0; i < 3600; ++i)
      if (getFixture().step().idle) return;
    FAIL() << "not idle after a minute";
  }

 private:
  Fixture& getFixture() { return static_cast<Fixture&>(*this); }
};

}  // namespace enfilade::scene::testing
