"""``python -m validation CASE`` is ``trackbed validate CASE``."""

import sys

from trackbed.command import main

sys.exit(main(["validate", *sys.argv[1:]]))
