"""Commands behind the evidence and its records, which ``cli.yaml`` lists: python -m evidence."""

from pathlib import Path

from dragchain.cli import PROGRAM as DRAGCHAIN
from dragdeck.cli import PROGRAM as DRAGDECK
from dragdeck.command_line import Program

PROGRAM = Program.read("evidence", Path(__file__).with_name("cli.yaml"), DRAGDECK, DRAGCHAIN)
main = PROGRAM.main

if __name__ == "__main__":
    PROGRAM()
