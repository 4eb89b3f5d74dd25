#include "server/hosting/horizon_subscriptions.hpp"

#include <algorithm>

#include "server/messages/world_messages.hpp"

namespace enfilade::server {
namespace {

using Horizon = scene::ContactHorizon;

const std::string kField = "subscribe.contact_horizon";

std::optional<v1::Error> validateAvatars(const scene::Snapshot& snapshot,
                                         const v1::ContactHorizonRequest& present,
                                         const v1::ContactHorizonRequest& request) {
  std::set<scene::EntityId> given;
  for (int i = 0; i < request.avatars_size(); ++i) {
    const scene::EntityId id = request.avatars(i);
    const std::string field = kField + ".avatars[" + std::to_string(i) + "]";
    const bool isPresent = std::ranges::find(snapshot.avatars, id, &scene::AvatarSnapshot::id) !=
                           snapshot.avatars.end();
    if (!isPresent && std::ranges::find(present.avatars(), id) == present.avatars().end())
      return makeError(v1::ERROR_UNKNOWN_ENTITY,
                       field + ": no avatar has the id " + std::to_string(id) +
                           "; give an id of a spawned avatar, or none for all avatars",
                       field);
    if (!given.insert(id).second)
      return makeError(v1::ERROR_BAD_MESSAGE, field + " is given twice: give each avatar once",
                       field);
  }
  return std::nullopt;
}

/// The avatars of all subscriptions; nullopt: all of the world.
std::optional<std::set<scene::EntityId>> collectSelection(const HostedWorld& hosted) {
  std::set<scene::EntityId> selected;
  for (const auto& [id, client] : hosted.clients) {
    if (!client.subscription.has_contact_horizon()) continue;
    const auto& avatars = client.subscription.contact_horizon().avatars();
    if (avatars.empty()) return std::nullopt;
    selected.insert(avatars.begin(), avatars.end());
  }
  return selected;
}

bool hasHorizonSubscriber(const HostedWorld& hosted) {
  return std::ranges::any_of(hosted.clients, [](const auto& one) {
    return one.second.subscription.has_contact_horizon();
  });
}

v1::ContactHorizon makeHorizonMessage(const Horizon& horizon, std::size_t approaches) {
  v1::ContactHorizon message;
  message.set_avatar(horizon.avatar);
  for (std::size_t i = 0; i < std::min(approaches, horizon.approaches.size()); ++i) {
    v1::ContactHorizon::Approach& approach = *message.add_approaches();
    approach.set_entity(horizon.approaches[i].entity);
    approach.set_not_before(horizon.approaches[i].notBefore);
  }
  for (const scene::EntityId entity : horizon.touching) message.add_touching(entity);
  message.set_unbounded(horizon.unbounded.entity);
  message.set_unbounded_distance(horizon.unbounded.gap);
  return message;
}

}  // namespace

std::optional<v1::Error> validateHorizons(const HostedWorld& hosted, const Client& client,
                                          const v1::Subscribe& subscription) {
  if (!subscription.has_contact_horizon()) return std::nullopt;
  const v1::ContactHorizonRequest& request = subscription.contact_horizon();
  if (request.assume() != v1::CannotTouchQuery::ASSUME_UNSPECIFIED &&
      request.assume() != v1::CannotTouchQuery::ASSUME_ANY_COMMAND)
    return makeError(v1::ERROR_BAD_MESSAGE,
                     kField +
                         ".assume: give ASSUME_ANY_COMMAND; present motion ends with any "
                         "command, so ask CannotTouchQuery for it",
                     kField + ".assume");
  if (request.approaches() > Horizon::kMaxApproaches)
    return makeError(v1::ERROR_BAD_MESSAGE,
                     kField + ".approaches: give 0 to " + std::to_string(Horizon::kMaxApproaches),
                     kField + ".approaches");
  return validateAvatars(*hosted.world.snapshot(), client.subscription.contact_horizon(), request);
}

void changeHorizons(HostedWorld& hosted, Client& client, const v1::Subscribe& subscription) {
  const v1::Subscribe& present = client.subscription;
  if (present.has_contact_horizon() == subscription.has_contact_horizon() &&
      present.contact_horizon().SerializeAsString() ==
          subscription.contact_horizon().SerializeAsString())
    return;
  client.sentHorizons.clear();
  hosted.horizonSelectionChanged = true;
}

void updateHorizons(HostedWorld& hosted) {
  if (!hasHorizonSubscriber(hosted)) return;
  if (!hosted.horizons)
    hosted.horizons =
        std::make_unique<scene::ContactHorizons>(hosted.scene, hosted.world.settings());
  if (std::exchange(hosted.horizonSelectionChanged, false))
    hosted.horizons->select(collectSelection(hosted));
  hosted.horizons->update(hosted.world.snapshot());
}

void resetHorizons(HostedWorld& hosted) {
  if (hosted.horizons) hosted.horizons->reset();
  for (auto& [id, client] : hosted.clients) client.sentHorizons.clear();
}

void addHorizons(Client& client, const scene::ContactHorizons& horizons, v1::TickEvents& events) {
  if (!client.subscription.has_contact_horizon()) return;
  const v1::ContactHorizonRequest& request = client.subscription.contact_horizon();
  const std::size_t approaches = std::max(1u, request.approaches());
  std::erase_if(client.sentHorizons,
                [&](const auto& sent) { return !horizons.horizons().contains(sent.first); });
  const auto add = [&](const Horizon& horizon) {
    const auto [sent, isNew] = client.sentHorizons.try_emplace(horizon.avatar);
    if (!isNew && horizon.changedTick != horizons.tick()) return;
    v1::ContactHorizon message = makeHorizonMessage(horizon, approaches);
    std::string bytes = message.SerializeAsString();
    if (bytes == sent->second) return;
    sent->second = std::move(bytes);
    *events.add_horizons() = std::move(message);
  };
  if (request.avatars().empty())
    for (const auto& [id, horizon] : horizons.horizons()) add(horizon);
  for (const scene::EntityId id : std::set(request.avatars().begin(), request.avatars().end()))
    if (const auto at = horizons.horizons().find(id); at != horizons.horizons().end())
      add(at->second);
}

}  // namespace enfilade::server
