"""Entry point of ``python -m app``."""

import sys

try:
    from app.cli import main
except KeyboardInterrupt:
    sys.stderr.write("Stopped.\n")
    sys.exit(130)

if __name__ == "__main__":
    sys.exit(main())
