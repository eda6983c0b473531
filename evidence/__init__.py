"""Evidence about LIGGGHTS and a study: contact law, stable time steps, agreement with a paper.

No study needs it. It may import dragdeck and dragchain, and neither of them imports it.
"""
