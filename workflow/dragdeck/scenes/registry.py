"""The scenes that a study's case has: a new one is its module and a line here."""

from dragdeck.scenes.drop_test import DROP_TEST
from dragdeck.scenes.filling import FILLING
from dragdeck.scenes.process import PROCESS
from dragdeck.scenes.scene import SceneType

SCENES: dict[str, SceneType] = {scene.name: scene for scene in (DROP_TEST, FILLING, PROCESS)}
