"""Motions that are superposed on the workpiece's path: one module for each kind."""
