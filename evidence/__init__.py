"""Evidence about LIGGGHTS itself: verification of its contact law, and its stable time steps.

No study needs it. It may import dragdeck and dragchain, and neither of them imports it.
"""
