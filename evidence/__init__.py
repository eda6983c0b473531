"""Evidence about LIGGGHTS and a study, and the records of designed scenes.

No study needs it. It may import dragdeck and dragchain, and neither of them imports it.
"""
