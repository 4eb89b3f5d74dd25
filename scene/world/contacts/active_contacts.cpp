#include "scene/world/contacts/active_contacts.hpp"

#include <algorithm>
#include <tuple>

#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

std::vector<ContactEvent> livingContacts(const World& world) {
  const WorldState& state = world.state();
  std::vector<ContactEvent> living;
  const auto add = [&](ContactEvent::Kind kind, EntityId a, const Contact& contact) {
    living.push_back(eventOf(state, kind, a, contact));
  };
  for (const auto& [name, avatar] : state.avatars)
    for (const Contact& contact : avatar.contacts)
      if (contact.touching) add(ContactEvent::Kind::begin, avatar.id, contact);
  for (const auto& [pair, contact] : state.bodyContacts)
    if (contact.touching) add(ContactEvent::Kind::begin, pair.first, contact);
  for (const std::uint32_t index : state.triggers) {
    Contact inside;
    inside.other = state.bodies[index].id;
    for (const EntityId who : state.bodies[index].inside)
      add(ContactEvent::Kind::enter, who, inside);
  }
  std::sort(living.begin(), living.end(), [](const ContactEvent& x, const ContactEvent& y) {
    return std::tie(x.a, x.b, x.kind) < std::tie(y.a, y.b, y.kind);
  });
  return living;
}

}  // namespace enfilade::scene
