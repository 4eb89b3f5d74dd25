#include "server/hosting/requests/welcome.hpp"

#include <chrono>

#include "protocol/framing.hpp"
#include "server/base/version.hpp"
#include "server/hosting/replay_control.hpp"
#include "server/hosting/world_directory.hpp"
#include "server/messages/body_messages.hpp"
#include "server/messages/world_messages.hpp"

namespace enfilade::server {

v1::Welcome makeWelcome(const HostedWorld& hosted) {
  v1::Welcome welcome;
  welcome.set_protocol_version(protocol::kVersion);
  welcome.set_server_version(kServerVersion);
  welcome.add_capabilities("free_run");
  welcome.add_capabilities("rays");
  welcome.add_capabilities("packed_rays");
  welcome.add_capabilities("pairs");
  welcome.add_capabilities("persists");
  welcome.add_capabilities("contact_horizon");
  welcome.add_capabilities("restart");
  welcome.add_capabilities("checkpoints");
  if (!hosted.frames.deviceName().empty()) {
    welcome.add_capabilities("frames");
    welcome.add_capabilities("shadows");
    welcome.add_capabilities("samples");
  }
  *welcome.mutable_scene() = toProto(hosted.world.scene());
  *welcome.mutable_policies() = toProto(hosted.world.settings());
  v1::Limits& limits = *welcome.mutable_limits();
  limits.set_max_message(protocol::kServerLimits.total);
  limits.set_max_upload(hosted.limits.uploadBytes);
  limits.set_max_avatars(hosted.limits.avatars);
  limits.set_max_picture_width(hosted.limits.imageSide);
  limits.set_max_picture_height(hosted.limits.imageSide);
  limits.set_max_ticks_per_step(hosted.limits.ticksPerStep);
  limits.set_max_waypoints(hosted.limits.waypoints);
  limits.set_max_rays(hosted.limits.rays);
  limits.set_max_watches(hosted.limits.frameSubscriptions);
  limits.set_max_scan_rays(hosted.limits.scanRays);
  limits.set_max_worlds(hosted.limits.worlds);
  limits.set_max_pairs(hosted.limits.pairs);
  limits.set_max_requests_under_way(hosted.limits.pendingRequests);
  limits.set_max_bytes_under_way(hosted.limits.pendingRequestBytes);
  limits.set_requests_per_second(hosted.limits.requestsPerSecond);
  const auto seconds = [](std::chrono::milliseconds time) {
    return std::chrono::duration<double>(time).count();
  };
  limits.set_max_unread_bytes(hosted.limits.outgoingBytes);
  limits.set_max_unread_pictures(static_cast<std::uint32_t>(hosted.limits.outgoingFrames));
  limits.set_max_connections(static_cast<std::uint32_t>(hosted.limits.connections));
  limits.set_max_described_ids(hosted.limits.describedIds);
  limits.set_hello_seconds(seconds(hosted.limits.helloTimeout));
  limits.set_message_seconds(seconds(hosted.limits.messageTimeout));
  welcome.set_tick(hosted.world.snapshot()->tick);
  welcome.set_renderer(hosted.frames.deviceName());
  welcome.set_software_renderer(hosted.frames.isSoftware());
  *welcome.mutable_clock() = toProto(hosted.clock);
  if (hosted.replay) {
    welcome.add_capabilities("replay");
    *welcome.mutable_replay() = makeReplayStatus(hosted);
  }
  welcome.set_world(hosted.identity.name);
  if (hosted.identity.directory) {
    welcome.add_capabilities("worlds");
    welcome.add_capabilities("step_many");
    welcome.add_capabilities("packed_steps");
    for (const std::string& scene : hosted.identity.directory->sceneNames())
      welcome.add_scenes(scene);
  }
  return welcome;
}

}  // namespace enfilade::server
