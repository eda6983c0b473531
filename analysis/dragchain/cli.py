"""The commands of ``dragchain``, which ``cli.yaml`` lists."""

from pathlib import Path

from dragdeck.cli import PROGRAM as DRAGDECK
from dragdeck.command_line import Program

PROGRAM = Program.read("dragchain", Path(__file__).with_name("cli.yaml"), DRAGDECK)
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
