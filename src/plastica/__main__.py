"""``python -m plastica`` is the command line."""

import sys

from plastica.doors.cli import main

if __name__ == "__main__":
    sys.exit(main())
