"""Put pages of finished runs into `reports/examples/`, as examples of what comes out.

python docs/figures/examples.py NAME=FOLDER [NAME=FOLDER ...]

Only the page is kept: links to the files beside it are taken off, the folder of the run is written
as `reports/NAME`, and of other paths the last part alone is kept.
"""

import re
import sys
from pathlib import Path

EXAMPLES = Path(__file__).parents[2] / "reports" / "examples"
FILES = re.compile(r' ?<span class="files">.*?</span>|<p>The same as files: .*?</p>\n', re.DOTALL)
LINK = re.compile(r'<a href="(?!#)[^"]*">(.*?)</a>', re.DOTALL)
FOLDERS = re.compile(r"(?<=[ >;])/(?:[\w.-]+/)+(?=[\w.-])")


def put(name: str, folder: Path) -> Path:
    """Write the page of a run to `reports/examples/NAME/index.html`."""
    text = (folder / "index.html").read_text("utf-8")
    for path in (folder.resolve(), folder):
        text = text.replace(path.as_posix(), f"reports/{name}")
    target = EXAMPLES / name / "index.html"
    target.parent.mkdir(parents=True, exist_ok=True)
    text = LINK.sub(r"\1", FILES.sub("", text))
    target.write_text(FOLDERS.sub("", text), "utf-8")
    return target


if __name__ == "__main__":
    for given in sys.argv[1:]:
        run, _, where = given.partition("=")
        put(run, Path(where))
