"""``python -m railsim`` is the command ``railsim``."""

import sys

from railsim.cli import main

if __name__ == "__main__":
    sys.exit(main())
