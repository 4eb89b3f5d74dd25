#include "scene/world/active_contacts.hpp"

#include <algorithm>
#include <tuple>

#include "scene/world/contacts/contact_events.hpp"
#include "scene/world/data/world_data.hpp"

namespace enfilade::scene {

std::vector<ContactEvent> collectActiveContacts(const World& world) {
  const WorldData& state = world.data();
  std::vector<ContactEvent> active;
  const auto append = [&](ContactEvent::Kind kind, EntityId a, const Contact& contact) {
    active.push_back(makeContactEvent(state, kind, a, contact));
  };
  for (const Avatar& avatar : state.avatars)
    for (const Contact& contact : avatar.contacts)
      if (contact.touching) append(ContactEvent::Kind::begin, avatar.id, contact);
  for (const auto& [pair, contact] : state.bodyContacts)
    if (contact.touching) append(ContactEvent::Kind::begin, pair.first, contact);
  for (const std::uint32_t index : state.triggers) {
    Contact inside;
    inside.other = state.bodies[index].id;
    for (const EntityId visitor : state.bodies[index].occupants)
      append(ContactEvent::Kind::enter, visitor, inside);
  }
  std::sort(active.begin(), active.end(), [](const ContactEvent& x, const ContactEvent& y) {
    return std::tie(x.a, x.b, x.kind) < std::tie(y.a, y.b, y.kind);
  });
  return active;
}

}  // namespace enfilade::scene
