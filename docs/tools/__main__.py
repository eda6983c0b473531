"""Make what the pages take from records, and draw the figures: python docs/tools [OPTION].

Without options, every block of every page is made anew (see `blocks`). ``--check`` only says which
pages would change.
"""

import argparse
import sys

from figures import draw_all
from notebooks import store_outputs
from page_files import changed_pages


def main() -> int:
    """Do what the options ask for; 1 if a check found a page that is not up to date."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="change nothing, list stale pages")
    parser.add_argument("--figures", action="store_true", help="draw the figures, too")
    parser.add_argument("--notebooks", action="store_true", help="run examples/, keep their output")
    parser.add_argument("page", nargs="*", help="only pages whose path contains this")
    options = parser.parse_args()
    stale = False
    for page, text in changed_pages(options.page):
        stale = True
        print(page)
        if not options.check:
            page.write_text(text, encoding="utf-8")
    if options.figures:
        draw_all()
    if options.notebooks:
        store_outputs()
    return int(options.check and stale)


if __name__ == "__main__":
    sys.exit(main())
