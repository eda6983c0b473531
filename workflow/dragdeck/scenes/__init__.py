"""Scenes: what one engine run models, and nothing it does not need."""

from dragdeck.scenes.common import Deck, LeftOut, Scene
from dragdeck.scenes.drop import drop_scene
from dragdeck.scenes.fill import fill_scene
from dragdeck.scenes.process import Bed, process_scene

__all__ = ["Bed", "Deck", "LeftOut", "Scene", "drop_scene", "fill_scene", "process_scene"]
