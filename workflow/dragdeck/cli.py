"""The commands of ``dragdeck``, which ``cli.yaml`` lists."""

from pathlib import Path

from dragdeck.command_line import Program

PROGRAM = Program.read("dragdeck", Path(__file__).with_name("cli.yaml"))
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
