// Contacts and near misses of kinematic bodies with static objects and with one another.
#pragma once

#include "scene/world/contacts/contact_events.hpp"

namespace enfilade::scene {

/// Contacts of moved kinematic bodies, without excluded pairs.
struct KinematicContacts {
  BodyContacts current;  ///< close in this tick or in the previous one
  /// Touched during the motion only, separated before and after the tick.
  BodyContacts transient;
};
KinematicContacts findKinematicContacts(WorldData& world, const ContactDistances& distances,
                                        QueryCount& count);

}  // namespace enfilade::scene
