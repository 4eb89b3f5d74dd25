"""Client of Enfilade, the server for virtual walk-throughs.

    import enfilade

    with enfilade.serve("building.glb") as server, server.connect() as client:
        client.subscribe(contacts=True)
        ann = client.spawn("ann", at=(1.5, 0, 0))
        ann.walk((6, 0, 0))
        client.run_until_idle()
        for contact in client.contacts():
            print(contact.tick, contact.kind, contact.b_name, contact.distance)
        picture = ann.frame(width=320, height=240, channels=("rgb", "depth"))

Metres, seconds, radians; right-handed, Y up. PROTOCOL.md describes the wire protocol.
"""

from . import messages
from .avatar import Avatar
from .cameras import Camera
from .client import Client, connect
from .environments import (Episode, VectorWalkEnv, WalkEnv, draw_episode, read_episodes,
                           write_episodes)
from .errors import (ConnectionFailed, EnfiladeError, EpisodeNotFound, OrderFailed, ServerError,
                     StartFailed)
from .lidar import Lidar, LidarPattern, PointCloud
from .navigation import Door, Island, Map, Navigation, Obstacle, Path, Spot
from .plans import FloorPlan, PlanRoom, PlanShape
from .process import Server, serve
from .results import (Apart, AvatarState, Contact, Frame, Hits, Horizon, Notice, ObjectInfo, Pair,
                      Replay, Scan, State, Step, Touching, World)
from .video import Video
from .world_group import WorldGroup

__all__ = [
    "Apart", "Avatar", "AvatarState", "Camera", "Client", "ConnectionFailed", "Contact", "Door",
    "EnfiladeError", "Episode", "EpisodeNotFound", "FloorPlan", "Frame", "Hits", "Horizon", "Island",
    "Lidar", "LidarPattern", "Map", "Navigation", "Notice", "ObjectInfo", "Obstacle", "OrderFailed", "Pair",
    "Path", "PlanRoom", "PlanShape", "PointCloud", "Replay", "Scan", "Server", "ServerError",
    "Spot", "StartFailed", "State", "Step", "Touching", "VectorWalkEnv", "Video", "WalkEnv",
    "World", "WorldGroup", "connect", "draw_episode", "messages", "read_episodes", "serve",
    "write_episodes",
]
