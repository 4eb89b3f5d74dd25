"""Learning environments with the interface of gymnasium: WalkEnv, VectorWalkEnv and their episodes."""

from .episodes import Episode, draw_episode, read_episodes, write_episodes
from .vector_walk_env import VectorWalkEnv
from .walk_env import WalkEnv

__all__ = ["Episode", "VectorWalkEnv", "WalkEnv", "draw_episode", "read_episodes", "write_episodes"]
