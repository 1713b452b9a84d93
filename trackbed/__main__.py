"""``python -m trackbed``."""

import sys

from trackbed.command import main

sys.exit(main())
