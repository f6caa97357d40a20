"""Print a command of README.md: the fenced line below its marker <!-- command: NAME -->."""

import re
import sys
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"
FENCE = r"<!-- command: {} -->\s*```\w*\n([^\n]+)\n```"


def command(name: str, text: str) -> str:
    found = re.findall(FENCE.format(re.escape(name)), text)
    if len(found) != 1:
        sys.exit(f"README.md: {len(found)} one-line commands marked '{name}', expected 1")
    return found[0]


if __name__ == "__main__":
    print(command(sys.argv[1], README.read_text("utf-8")))
